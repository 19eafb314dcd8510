"""What object and finger keep clear of: paths for the next push among it, and whether a motion is free."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from ...errors import InputError
from ...geometry import Outline, compose, pose_error, rotate, transform, wrap_angle
from ...geometry.collision import Body, World
from ...geometry.collision.world import WorldArrays
from ...geometry.pose import Array
from ...planning.obstacles import Search, obstructions
from ...planning.options import PushOption
from ...planning.path import Path
from ...planning.query import Query
from ...problem import Pusher, Scene
from ...steering.fleet import Fleet
from .contact_car import ContactCar
from .landings import Landing, fleet_of_contacts, free_path
from .push_path import PushPath

# Paths keep so much more than the scene's clearance, for noise, latency and another table; less if there is none [m].
MARGINS = (0.003, 0.002, 0.001, 0.0005)
# A push stops before it comes nearer than this share of the margin of its path.
GUARD = 0.4
# Angles at a goal of any angle that are searched for; on the way downhill they move on from them.
ANGLES = 12
# Rounds of the search without a path, and after the first.
ROUNDS, BETTER = 40, 6
# Back from the object the finger goes by the first of these shares of the approach that is free.
BACK = (1.0, 0.5, 0.25)


class RoomyPath(NamedTuple):
    """A path, and what it keeps beyond the scene's clearance [m]."""

    path: Path
    margin: float


FoundT = TypeVar("FoundT")


class Thoughts(Generic[FoundT]):
    """Work in parts, for a tick each: the same parts whenever they are asked for, done when first asked for.

    Args:
        parts: None for each part, and then what was found.
    """

    def __init__(self, parts: Iterator[FoundT | None]) -> None:
        self._parts, self._done = parts, list[FoundT | None]()

    def part(self, number: int) -> FoundT | None:
        """What was found after so many parts, counted from 0; None as long as nothing is."""
        while len(self._done) <= number:
            self._done.append(next(self._parts))
        return self._done[number]


def crowded(scene: Scene) -> bool:
    """Whether a scene has bounds or obstacles.

    Raises:
        InputError: if it has, and fingers that are not lifted between pushes.
    """
    if scene.workspace.bounds is None and not scene.workspace.obstacles:
        return False
    if scene.pusher.transit != "lift":
        raise InputError(
            "among bounds and obstacles the horizon controller lifts the fingers between pushes",
            key="pusher.transit",
            value=scene.pusher.transit,
            hint="transit: lift, or follow the plan with the path controller.",
        )
    return True


def way_over(pusher: Pusher, place: Array, pose: Array, hand: Array) -> Array:
    """Up, over and down beside a contact, and then onto it: stops of the hand, X_WE and height, shape (4, 4).

    Args:
        place: X_OE at the contact. pose: X_WO. hand: X_WE now.
    """
    contact, before = compose(pose, place), compose(pose, compose(place, [-pusher.approach, 0.0, 0.0]))
    turn = hand[2] + pose_error(contact, hand)[2]
    return np.array(
        [
            [*hand, pusher.lift],
            [*before[:2], turn, pusher.lift],
            [*before[:2], turn, 0.0],
            [*contact[:2], turn, 0.0],
        ]
    )


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Of a scene with bounds or obstacles.

    Attributes:
        scene: whose clearance is kept. options: the pushes that have a car.
    """

    scene: Scene
    options: tuple[PushOption, ...]

    @cached_property
    def world(self) -> World:
        """Bounds and obstacles."""
        return World.of(self.scene.workspace.bounds, self.scene.workspace.obstacles)

    @cached_property
    def _arrays(self) -> tuple[WorldArrays, Body]:
        return self.world.arrays, Body.of(Outline.circle(max(self.scene.pusher.tip_radius, 1e-9)))

    def next_push(
        self, cars: Sequence[ContactCar | None], pose: Array, goal: Array, switching: float, seed: int
    ) -> Iterator[Landing | str | None]:
        """Where one finger lands next with an object at X_WO, and the path of that push; or why there is none.

        Args:
            cars: of the options; None where one is left out. goal: X_WO. switching, seed: see landings.next_push.

        Returns:
            what is found comes last, after None for every part of the work.
        """
        known = [(k, car) for k, car in enumerate(cars) if car is not None]
        if not known:
            yield "no push can be steered"
            return
        fleet = fleet_of_contacts([car for _, car in known], switching)
        for found in self.paths(fleet, [self.options[k] for k, _ in known], pose, goal, seed):
            if isinstance(found, RoomyPath):
                first = PushPath.of(found.path, found.margin)
                yield Landing(known[found.path.pushes[0]][0], first.poses[-1], float(first.left[0]), first)
            else:
                yield found

    def paths(
        self, fleet: Fleet, options: Sequence[PushOption], pose: Array, goal: Array, seed: int
    ) -> Iterator[RoomyPath | str | None]:
        """Of the paths from X_WO with the most room to spare the cheapest that is found, as next_push.

        Args:
            fleet: the cars of options. goal: X_WO; its angle is NaN where any will do.
        """
        pusher, free = self.scene.pusher, bool(np.isnan(goal[2]))
        angles = wrap_angle(pose[2] + np.arange(ANGLES) * (2 * np.pi / ANGLES)) if free else goal[2:]
        ends = [np.array([goal[0], goal[1], angle]) for angle in angles]
        places = [option.placement for option in options if option.placement is not None]
        query = Query(
            fleet,
            pose,
            ends[0],
            self.world,
            [Body.of(self.scene.object.outline, p.tips, pusher.tip_radius) for p in places],
            np.array([transform([0.0, 0.0, p.pose[2]], [-pusher.approach, 0.0]) for p in places]),
            free=free,
        )
        direct: Path | None = None
        complaint = ""
        for margin in MARGINS:
            asked = replace(query, clearance=self.scene.clearance + margin)
            able = [end for end in ends if asked.able(end)] if free else ends
            if able:
                asked = replace(asked, goal=able[0], other_goals=np.array(able[1:]).reshape(-1, 3))
            if not asked.first or not asked.last:
                complaint = obstructions(self.scene, asked, options)
                continue
            if direct is None:
                direct = free_path(asked, seed)
                yield None
            search = Search(asked, seed)
            if not search.offer(direct):
                found = 0
                for path in islice(search.rounds(), ROUNDS):
                    yield None
                    found += path is not None
                    if found > BETTER:
                        break
            if search.best is not None:
                yield RoomyPath(search.best, margin)
                return
            complaint = f"no path with {1000 * asked.clearance:.2f} mm of clearance was found from here"
        yield complaint

    def free(self, tips: Array, pose: Array, twist: Array, margin: float) -> bool:
        """Whether object and fingers keep the clearance and a margin [m], or do not come nearer than they are, along a
        constant twist.

        Args:
            tips: centres of the fingers in O, shape (k, 2). pose: X_WO. twist: in O, over the whole motion, shape (3,).
        """
        from ...geometry.collision.kernels import pose_gap, twist_gap

        need = self.scene.clearance + margin
        body = Body.of(self.scene.object.outline, tips, self.scene.pusher.tip_radius).arrays
        world = self._arrays[0]
        if twist_gap(world, body, pose, twist, need, need) >= need:
            return True
        now = pose_gap(world, body, pose, need, -np.inf)
        return bool(now < need and twist_gap(world, body, pose, twist, need, -np.inf) >= now - 1e-6)

    def back(self, hand: Array, angle: float, tips: Array | None = None) -> Array:
        """Where a hand at X_WE goes that leaves the object, against the direction of an angle [rad]: shape (3,).

        Args:
            tips: centres of the fingers in E, shape (k, 2); default: one at its origin.
        """
        from ...geometry.collision.kernels import twist_gap

        world, finger = self._arrays
        places = transform(hand, np.zeros((1, 2)) if tips is None else tips)
        need = self.scene.clearance
        for share in BACK:
            step = np.array([*rotate(angle, np.array([-share * self.scene.pusher.approach, 0.0])), 0.0])
            starts = [np.array([*place, 0.0]) for place in places]
            if all(twist_gap(world, finger.arrays, at, step, need, need) >= need for at in starts):
                return hand + step
        return hand
