"""First pushes on a table of which nothing is known: short ones at different sides that are safe on any table."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...documents.motion_file import Motion
from ...errors import InputError
from ...friction import Support
from ...geometry import OutlinePoint, pose_error, rotate, transform
from ...geometry.pose import Array
from ...problem import Object, Scene
from ...simulation.plant import Plant
from ..loop.controller import AbstractController, ControllerState
from ..loop.frames import hand, mean_pose
from ..loop.limits import Limits, beyond
from ..loop.measurement import Command, Measurement
from .plan_controller import FRAMES, LOOK, Looking, Travelling

#: Outcome of a controller that has made its pushes.
TAUGHT = "taught"
# How many pushes teach, and how long they are; shorter ones where there is no room [m].
PUSHES, LENGTHS = 6, (0.06, 0.045, 0.03)
# Places along an edge and directions to the inward normal [rad] that are tried.
ALONG, DIRECTIONS = (0.2, 0.35, 0.5, 0.65, 0.8), np.deg2rad([-25.0, 0.0, 25.0])
# Object and finger keep so far from the bounds on every table that is imagined [m].
ROOM = 0.003
# An object goes on as it moved over so much of the hand's way [m].
BEHIND = 0.002
# Samples of a push that is imagined.
SAMPLES = 15


@dataclass(frozen=True, eq=False)
class TeachState(ControllerState):
    """Of FirstPushes.

    Attributes:
        phase: what it does. made: contacts in O of the pushes that were made or begun, (k, 2).
        legs: from when to when each push lasted [s]. film: frames, (time, object (3,), pusher (3,)).
    """

    phase: Looking | Travelling = field(default_factory=lambda: Looking(-np.inf))
    made: tuple[Array, ...] = ()
    legs: tuple[tuple[float, float], ...] = ()
    film: tuple[tuple[float, Array, Array], ...] = ()


@dataclass(frozen=True, eq=False)
class FirstPushes(AbstractController[TeachState]):
    """Pushes the object a little at several sides, and keeps what was seen. Build with FirstPushes.of.

    Attributes:
        scene: of one finger; its support does not matter. rate, limits, stale, noise: see AbstractController.
        tables: plants with supports among which the true one may lie; a push must be safe on each.
        count: how many pushes.
    """

    scene: Scene
    limits: Limits
    tables: tuple[Plant, ...] = ()
    rate: float = 60.0
    stale: float = 0.6
    noise: tuple[float, float] = (0.0003, float(np.deg2rad(0.3)))
    count: int = PUSHES

    @classmethod
    def of(
        cls, scene: Scene, rate: float = 60.0, *, stale: float = 0.6, count: int = PUSHES
    ) -> "FirstPushes":
        """For a scene.

        Args:
            rate: of the ticks [Hz]. stale: age at which a frame is too old [s]. count: how many pushes.

        Raises:
            InputError: for two fingers, and for obstacles.
        """
        if scene.pusher.fingers != 1:
            raise InputError("an unknown table is learned with one finger", key="pusher.fingers", value=2)
        if scene.workspace.obstacles:
            raise InputError(
                "an unknown table is learned inside bounds, without obstacles", key="workspace.obstacles",
                hint="Learn it elsewhere: flatpush identify.",
            )  # fmt: skip
        limits = Limits.of(scene.pusher, np.zeros((1, 2)), scene.object.outline.size)
        return cls(scene, limits, imagined(scene.object, scene.pusher.tip_radius), rate, stale, count=count)

    def start(self, time: float = 0.0) -> TeachState:
        return TeachState(phase=Looking(time))

    def noticed(self, state: TeachState, frame: Measurement) -> TeachState:
        pose = np.asarray(frame.object, dtype=float)
        film = (*state.film, (frame.time, pose, np.asarray(frame.pusher, dtype=float)))
        phase = state.phase
        if isinstance(phase, Looking) and frame.time >= phase.since - 1e-9:
            first = frame.time if not phase.poses else phase.first
            phase = replace(phase, poses=(*phase.poses, pose), first=first)
        return replace(state, film=film, phase=phase)

    def act(self, state: TeachState, time: float) -> tuple[TeachState, Command]:
        phase, seen = state.phase, state.seen
        assert seen.frame is not None
        if isinstance(phase, Travelling):
            return self._travel(state, phase, time)
        if len(phase.poses) < FRAMES or seen.frame.time - phase.first < LOOK:
            return replace(state, mode="looking", note=""), self._standing(state)
        if len(state.legs) == self.count:
            return replace(state, mode="done", outcome=TAUGHT), self._standing(state)
        pose = mean_pose(phase.poses)
        chosen = next_push(self.scene, self.tables, pose, state.made)
        if chosen is None:
            enough = len(state.legs) > 0
            why = TAUGHT if enough else "no push of 30 mm is safe from here: the bounds are too narrow"
            return replace(state, mode="done", outcome=why), self._standing(state)
        at, direction, length = chosen
        pusher, here = self.scene.pusher, hand(seen.frame, seen.told, time)
        along = rotate(float(pose[2]), rotate(direction, at.normal))
        contact = transform(pose, at.point - pusher.tip_radius * at.normal)
        before, end = contact - pusher.approach * along, contact + length * along
        stops = (
            (*here[:2], pusher.lift), (*before, pusher.lift), (*before, 0.0), (*end, 0.0),
            (*(end - pusher.approach * along), 0.0),
        )  # fmt: skip
        going = Travelling(tuple(np.array([x, y, here[2], z]) for x, y, z in stops), True)
        return self._travel(replace(state, made=(*state.made, at.point)), going, time)

    def _travel(self, state: TeachState, phase: Travelling, time: float) -> tuple[TeachState, Command]:
        seen = state.seen
        assert seen.frame is not None
        here, stops, legs = hand(seen.frame, seen.told, time), phase.stops, state.legs
        still = not np.any(seen.last.velocity) and seen.climb == 0
        while stops and still and np.max(np.abs(stops[0] - [*here, seen.height])) < 1e-6:
            stops = stops[1:]
            if len(stops) == 2:  # it lies on the table before the contact
                legs = (*legs, (time, np.inf))
            elif len(stops) == 1:
                legs = (*legs[:-1], (legs[-1][0], time))
        if not stops:
            return replace(state, phase=Looking(time), legs=legs), self._standing(state)
        mode = "teaching" if len(stops) == 2 else "transit"
        if mode == "teaching" and self._leaves(state, legs[-1][0], here):
            why = "stopped before the object left the bounds: it moves as on no table that was imagined"
            return replace(state, mode="done", legs=legs, ending=why), self._standing(state)
        state = replace(state, mode=mode, note="", legs=legs, phase=replace(phase, stops=stops))
        table = bool(stops[0][3] == 0 and seen.height == 0)
        return state, self.limits.towards(
            stops[0], here, seen.height, seen.last, seen.climb, 1 / self.rate, table
        )

    def _leaves(self, state: TeachState, begun: float, here: Array) -> bool:
        """Whether the object would be outside the bounds where the hand, now at X_WE, comes to rest, if it goes on to
        move with the hand as it did over the last 2 mm; the push has begun at a time [s]."""
        bounds, velocity = self.scene.workspace.bounds, state.seen.last.velocity[:2]
        if bounds is None or not state.film or state.film[-1][0] < begun:
            return False
        _, pose, at = state.film[-1]
        ahead = float(velocity @ velocity) / (2 * self.scene.pusher.acceleration)
        ways = ((float(np.hypot(*(at - row[2])[:2])), row) for row in reversed(state.film))
        way, before = next(((way, row[1]) for way, row in ways if way >= BEHIND), (np.inf, pose))
        further = (float(np.hypot(*(here - at)[:2])) + ahead) / way
        there = pose + further * pose_error(pose, before)
        return beyond(transform(there, self.scene.object.outline.polyline()), bounds) > 0


def filmed(state: TeachState) -> list[Motion]:
    """The recordings of the pushes that were made."""
    found = []
    for k, (begin, end) in enumerate(state.legs):
        rows = [row for row in state.film if begin <= row[0] <= end]
        if len(rows) > 1:
            poses = np.array([pose for _, pose, _ in rows])
            tips = np.array([pusher[:2] for *_, pusher in rows])
            times = np.array([t for t, *_ in rows])
            found.append(Motion(f"first push {k + 1}", times, poses, tips, np.arange(len(rows)) + 1))
    return found


def imagined(thing: Object, tip_radius: float) -> tuple[Plant, ...]:
    """Plants of an object on supports that differ as much as they can: face, rim, and three feet at each end."""
    corners = thing.outline.polyline()
    middle = thing.outline.centroid
    found = [Object(thing.outline, word, thing.friction) for word in ("uniform", "outline")]
    for turn in (0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi):
        ahead = rotate(turn, np.array([1.0, 0.0]))
        far = corners[np.argsort((corners - middle) @ ahead)[-2:]]
        feet = middle + 0.9 * (np.vstack([far, middle + 0.1 * (far.mean(axis=0) - middle)]) - middle)
        if abs(np.cross([*(feet[1] - feet[0]), 0], [*(feet[2] - feet[0]), 0])[2]) > 1e-6:
            found.append(Object(thing.outline, Support.points(feet, [1, 1, 1]), thing.friction))
    return tuple(Plant(one, [[0.0, 0.0]], tip_radius) for one in found)


def next_push(
    scene: Scene, tables: tuple[Plant, ...], pose: Array, made: tuple[Array, ...]
) -> tuple[OutlinePoint, float, float] | None:
    """Place, direction to the inward normal [rad] and length [m] of a push far from those that were made, which leaves
    object and finger inside the bounds on every table that is imagined; None if there is none.

    Args:
        pose: X_WO (3,). made: contacts in O of earlier pushes.
    """
    outline, tip, bounds = scene.object.outline, scene.pusher.tip_radius, scene.workspace.bounds
    if outline.is_circle:
        places = [outline.at(0, k / 12) for k in range(12)]
    else:
        places = [outline.at(edge, along) for edge in range(len(outline.vertices)) for along in ALONG]
    places = [p for p in places if outline.nearest(p.point - tip * p.normal).distance > tip - 1e-6]
    home = scene.goal_pose[:2] - pose[:2]
    home = rotate(-pose[2], home / max(float(np.hypot(*home)), 1e-9))

    def worth(at: OutlinePoint, direction: float) -> float:
        """Far from what was done, towards the goal, and every other one skew: it slides, which tells the friction."""
        away = min((float(np.hypot(*(at.point - p))) for p in made), default=0.0) / outline.size
        skew = 0.05 if (len(made) % 2 == 0) == (direction == 0) else 0.0
        return away + 0.15 * float(rotate(direction, at.normal) @ home) - skew

    if bounds is not None and beyond(transform(pose, outline.polyline()), bounds) > 0:
        return None
    options = sorted(((worth(p, float(d)), k, j) for k, p in enumerate(places) for j, d in enumerate(DIRECTIONS)),
                     reverse=True)  # fmt: skip
    for length in LENGTHS:
        for _, k, j in options:
            if _safe(scene, tables, pose, places[k], float(DIRECTIONS[j]), length):
                return places[k], float(DIRECTIONS[j]), length
    return None


def _safe(
    scene: Scene, tables: tuple[Plant, ...], pose: Array, at: OutlinePoint, direction: float, length: float
) -> bool:
    pusher, bounds = scene.pusher, scene.workspace.bounds
    contact = at.point - pusher.tip_radius * at.normal
    along = rotate(direction, at.normal)
    tips = transform(pose, contact + np.outer(np.linspace(0, length, SAMPLES), along))
    begin = transform(pose, contact - pusher.approach * along)
    if bounds is not None and beyond(np.vstack([begin, tips]), bounds, ROOM + pusher.tip_radius) > 0:
        return False
    corners = scene.object.outline.polyline()
    for plant in tables:
        run = plant.follow(pose, np.column_stack([tips, np.zeros(len(tips))]))
        if run.outcome:
            return False
        points = transform(run.object[:, None, :], corners).reshape(-1, 2)
        if bounds is not None and beyond(points, bounds, ROOM) > 0:
            return False
    return True
