"""Entries: flatpush's planner, OMPL with the car of one push, and any policy of flatpush/Push-v0."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from types import ModuleType

import numpy as np
from judge import Array, Entry, Policy, collision, fingertips, length

import flatpush as fp
from flatpush.geometry import compose, inverse, rotate, wrap_angle
from flatpush.problem import TransitSegment
from flatpush.steering.car import Car

SECONDS = 2.0  # of CPU that OMPL has for a scene
ITERATIONS = 3300  # of our search: a round of the refinement, about as long
TIME_LIMIT = 20.0  # that cuts it short only on a machine that is busy [s]
TOLERANCE = (
    5e-4,
    5e-4,
    np.deg2rad(0.5),
)  # at which planners aim, so that another simulator may differ [m, m, rad]
ROOM = (-0.3, -0.3, 0.3, 0.3)  # of OMPL's search where the scene has no bounds [m]
TRIED = 3  # pushes
SAMPLE = 1e-3  # of a Dubins path [m]


def open_loop(plan: Callable[[fp.Scene], list[Array]]) -> Entry:
    """An entry that works out all strokes before the first one, and does not look again."""

    def entry(scene: fp.Scene) -> Policy:
        strokes: Iterator[Array] = iter(plan(scene))
        return lambda pose: next(strokes, None)

    return entry


def flatpush_strokes(scene: fp.Scene) -> list[Array]:
    """Our planner. Two fingers without friction cannot steer: there one leads and slides, the other follows behind."""
    alone = scene.pusher.fingers == 2 and scene.object.friction == 0.0
    pusher = replace(scene.pusher, fingers=1, spacing=0.0) if alone else scene.pusher
    planning = replace(scene.planning, iterations=ITERATIONS, time_limit=TIME_LIMIT, goal_tolerance=TOLERANCE)
    plan = fp.plan(replace(scene, pusher=pusher, planning=planning))
    strokes = [s.pusher for s in plan.segments if not isinstance(s, TransitSegment)]
    return [behind(scene, stroke) for stroke in strokes] if alone else strokes


def behind(scene: fp.Scene, stroke: Array) -> Array:
    """The straight stroke of one finger as that of a hand whose other finger trails."""
    heading = float(np.arctan2(*(stroke[-1, :2] - stroke[0, :2])[::-1]))
    yaw = heading - np.pi / 2  # the fingertip at +y of the hand is in front
    place = stroke[:, :2] - rotate(yaw, fingertips(scene)[0])
    return np.column_stack([place, np.full(len(stroke), yaw)])


def flatpush_looking(scene: fp.Scene) -> Policy:
    """Our planner, planning anew after every stroke from where the object is, until it is at its goal."""
    left = [10]

    def policy(pose: Array) -> Array | None:
        left[0] -= 1
        now = replace(scene, start=pose)
        if left[0] < 0 or np.all(np.abs(now.goal_error(pose)) <= np.array(TOLERANCE)):
            return None
        strokes = flatpush_strokes(now)
        return strokes[0] if strokes else None

    return policy


def ompl_strokes(scene: fp.Scene) -> list[Array]:
    """One push as a Dubins car under the ellipsoidal limit surface, its way by OMPL, with RRT* among obstacles.

    Of the pushes that steer the three with the shortest Dubins paths are tried; without friction there is none.
    """
    try:
        from ompl import base, geometric, util
    except ImportError:
        raise SystemExit("the entry ompl needs OMPL: pip install ompl") from None
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(1)
    asked = replace(scene, planning=replace(scene.planning, model="ellipsoid", slides="never"))
    cars = [option.car for option in fp.Planner(asked).usable if option.car is not None]
    ways = sorted((_Dubins(scene, car, base) for car in cars), key=lambda way: way.direct)
    crowded = bool(scene.workspace.obstacles)
    found = [way.solved(geometric, SECONDS / TRIED) if crowded else way.straight() for way in ways[:TRIED]]
    return min((strokes for strokes in found if strokes), key=lambda s: length(scene, s[0]), default=[])


class _Dubins:
    """The Dubins car of a push in OMPL: the frame of its flat point."""

    def __init__(self, scene: fp.Scene, car: Car, base: ModuleType) -> None:
        self.scene, self.car, self.base = scene, car, base
        self.frame = np.array([*car.flat_point, np.arctan2(car.direction[1], car.direction[0])])
        self.space = base.DubinsStateSpace(car.radius)
        box = base.RealVectorBounds(2)
        for axis, (low, high) in enumerate(np.reshape(scene.workspace.bounds or ROOM, (2, 2)).T):
            box.setLow(axis, low)
            box.setHigh(axis, high)
        self.space.setBounds(box)
        self.start, self.goal = (
            self.state(compose(X, self.frame)) for X in (scene.start_pose, scene.goal_pose)
        )
        self.direct = self.space.distance(self.start, self.goal)

    def state(self, pose: Array):  # type: ignore[no-untyped-def]
        made = self.space.allocState()
        made.setXY(float(pose[0]), float(pose[1]))
        made.setYaw(float(wrap_angle(pose[2])))
        return made

    def object(self, state) -> Array:  # type: ignore[no-untyped-def]
        """X_WO at a state."""
        return compose(np.array([state.getX(), state.getY(), state.getYaw()]), inverse(self.frame))

    def straight(self) -> list[Array]:
        return self.stroke([self.start, self.goal])

    def solved(self, geometric: ModuleType, seconds: float) -> list[Array]:
        began, setup = time.process_time(), geometric.SimpleSetup(self.space)
        information = setup.getSpaceInformation()
        setup.setStateValidityChecker(self.free)
        information.setStateValidityCheckingResolution(0.01)
        setup.setStartAndGoalStates(self.start, self.goal, 1e-6)
        setup.setPlanner(geometric.RRTstar(information))
        setup.solve(self.base.PlannerTerminationCondition(lambda: time.process_time() - began > seconds))
        if not setup.haveExactSolutionPath():
            return []
        path = setup.getSolutionPath()
        return self.stroke([path.getState(k) for k in range(path.getStateCount())])

    def free(self, state) -> bool:  # type: ignore[no-untyped-def]
        pose = self.object(state)
        return self.space.satisfiesBounds(state) and not collision(
            self.scene, pose[None], compose(pose, self.car.pusher)[None]
        )

    def stroke(self, states: list[object]) -> list[Array]:
        """The hand along the path through states, where it sticks to the object."""
        hands, between = [], self.space.allocState()
        for a, b in pairwise(states):
            for share in np.linspace(0.0, 1.0, 2 + int(self.space.distance(a, b) / SAMPLE)):
                self.space.interpolate(a, b, float(share), between)
                hands.append(compose(self.object(between), self.car.pusher))
        made = np.array(hands)
        made[:, 2] = np.unwrap(made[:, 2])
        return [made]


def policy_entry(make: Callable[[object], Callable[[Array], Array]]) -> Entry:
    """An entry from a policy of flatpush/Push-v0: make(task) gives a function from state to action.

    A stroke is one decision, a tenth of a second; the fingers stay on the table.
    """

    def entry(scene: fp.Scene) -> Policy:
        from flatpush.gym import PushTask

        task = PushTask(scene, random=False)
        act, hand = make(task), [task.drawn(np.random.default_rng(0))[1]]

        def policy(pose: Array) -> Array | None:
            if task.solved(pose, scene.goal_pose):
                return None
            hands = task.moved(hand[0], act(task.state(pose, hand[0], scene.goal_pose)))
            hand[0] = hands[-1]
            return hands[[0, -1]]

        return policy

    return entry


def baseline(task: object) -> Callable[[Array], Array]:
    """Our planner as a policy, one finger."""
    from flatpush.gym import PushPolicy, PushTask

    assert isinstance(task, PushTask)
    return PushPolicy(task).act


ENTRIES: dict[str, Entry] = {
    "flatpush": open_loop(flatpush_strokes),
    "flatpush-looking": flatpush_looking,
    "ompl": open_loop(ompl_strokes),
    "policy": policy_entry(baseline),
}
