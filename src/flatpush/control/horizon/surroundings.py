"""What object and finger keep clear of: ways for the next push among it, and whether a motion is free."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from ...geometry import Outline, rotate, transform
from ...geometry.collision import Body, World
from ...geometry.collision.world import WorldArrays
from ...geometry.pose import Array
from ...planning.obstacles import Search, obstructions
from ...planning.options import PushOption
from ...planning.path import Path
from ...planning.query import Query
from ...problem import Scene
from .contact_car import ContactCar
from .landings import Landing, fleet_of_contacts, free_path
from .way import Way

# Ways keep so much more than the scene's clearance, for noise, latency and another table; or less if there is none [m].
MARGINS = (0.003, 0.002, 0.001, 0.0005)
# A push stops before it comes nearer than this share of the margin of its way.
GUARD = 0.4
# Rounds of the search without a way, and after the first.
ROUNDS, BETTER = 40, 6
# Back from the object the finger goes by the first of these shares of the approach that is free.
BACK = (1.0, 0.5, 0.25)


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
    ) -> Landing | str:
        """Where to land next with an object at X_WO, with the way of that push; or why there is none.

        Of the ways with the most room to spare the cheapest that was found.

        Args:
            cars: of the options; None where one is left out. goal: X_WO. switching, seed: see landings.next_push.
        """
        known = [(k, car) for k, car in enumerate(cars) if car is not None]
        if not known:
            return "no push can be steered"
        pusher = self.scene.pusher
        options = [self.options[k] for k, _ in known]
        fleet = fleet_of_contacts([car for _, car in known], switching)
        places = [option.placement for option in options if option.placement is not None]
        query = Query(
            fleet,
            pose,
            goal,
            self.world,
            [Body.of(self.scene.object.outline, p.tips, pusher.tip_radius) for p in places],
            np.array([transform([0.0, 0.0, p.pose[2]], [-pusher.approach, 0.0]) for p in places]),
        )
        direct: Path | None = None
        complaint = ""
        for margin in MARGINS:
            asked = replace(query, clearance=self.scene.clearance + margin)
            if not asked.first or not asked.last:
                complaint = obstructions(self.scene, asked, options)
                continue
            search = Search(asked, seed)
            direct = direct or free_path(asked, seed)
            if not search.offer(direct):
                self._searched(search)
            if search.best is not None:
                way = Way.of(search.best, margin)
                push = known[search.best.pushes[0]][0]
                return Landing(push, way.poses[-1], float(way.left[0]), way)
            complaint = f"no way with {1000 * asked.clearance:.2f} mm of clearance was found from here"
        return complaint

    @staticmethod
    def _searched(search: Search) -> None:
        """Goes on for some rounds, and for a few after the first way."""
        since = 0
        for path in islice(search.rounds(), ROUNDS):
            since += path is not None
            if since > BETTER:
                break

    def free(self, tip: Array, pose: Array, twist: Array, margin: float) -> bool:
        """Whether object and finger keep the clearance and a margin [m], or do not come nearer than they are, along a
        constant twist.

        Args:
            tip: centre of the finger in O, shape (2,). pose: X_WO. twist: in O, over the whole motion, shape (3,).
        """
        from ...geometry.collision.kernels import pose_gap, twist_gap

        need = self.scene.clearance + margin
        body = Body.of(self.scene.object.outline, tip[None], self.scene.pusher.tip_radius).arrays
        world = self._arrays[0]
        if twist_gap(world, body, pose, twist, need, need) >= need:
            return True
        now = pose_gap(world, body, pose, need, -np.inf)
        return bool(now < need and twist_gap(world, body, pose, twist, need, -np.inf) >= now - 1e-6)

    def back(self, hand: Array, angle: float) -> Array:
        """Where a finger at X_WE goes that leaves the object, against the direction of an angle [rad]: shape (3,)."""
        from ...geometry.collision.kernels import twist_gap

        world, finger = self._arrays
        at, need = np.array([hand[0], hand[1], 0.0]), self.scene.clearance
        for share in BACK:
            step = rotate(angle, np.array([-share * self.scene.pusher.approach, 0.0]))
            if twist_gap(world, finger.arrays, at, np.array([*step, 0.0]), need, need) >= need:
                return hand + np.array([*step, 0.0])
        return hand
