"""The way of the tool over time: from where it is to before the first contact, and then as planned."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..control.loop.limits import turn_within
from ..errors import InputError
from ..geometry.pose import Array
from ..planning.transits import PusherPath
from ..problem import Plan, Pusher, TransitSegment
from .arms import ORDINALS
from .robot import Limits, OutOfLimits

# Limits may be passed by this part: the rounding of differences.
SLACK = 1e-6
# Samples nearer than this are one [s].
SAME_TIME = 1e-9
TURN = 2 * np.pi
# So far below its lift a hand is up [m].
SAME_HEIGHT = 1e-9


@dataclass(frozen=True, eq=False)
class Course:
    """Poses over time, straight from one to the next.

    Attributes:
        times: rising, shape (n,) [s].
        poses: (x, y, height, yaw), shape (n, 4).
        leg: of the step that ends at each pose, an index of `legs`, shape (n,).
        legs: names, such as "segment 1 (push long edge)".
        pushes: for each leg the number in the scene, from 1, of its push or the one before (slides come last); -1
            before the plan begins.
    """

    times: Array
    poses: Array
    leg: NDArray[np.intp]
    legs: tuple[str, ...]
    pushes: tuple[int, ...]

    @property
    def duration(self) -> float:
        return float(self.times[-1] - self.times[0])

    def at(self, time: float) -> tuple[Array, Array, int]:
        """Pose and twist at a time from the start, and the leg."""
        t = min(time, self.duration) + float(self.times[0])
        k = min(max(int(np.searchsorted(self.times, t, side="left")), 1), len(self.times) - 1)
        span = self.times[k] - self.times[k - 1]
        rate = (self.poses[k] - self.poses[k - 1]) / span
        moving = time < self.duration
        pose = self.poses[k - 1] + (t - self.times[k - 1]) * rate if moving else self.poses[-1]
        return np.asarray(pose), rate if moving else np.zeros(4), int(self.leg[k])

    def part(self, first: int, last: int, turned: float) -> "Course":
        """From one pose to another, by their numbers, with the hand turned [rad]."""
        keep = slice(first, last + 1)
        poses = self.poses[keep] + np.array([0.0, 0.0, 0.0, turned])
        return replace(self, times=self.times[keep], poses=poses, leg=self.leg[keep])

    def then(self, other: "Course") -> "Course":
        """This one and another that starts where it ends."""
        shift = float(self.times[-1] - other.times[0])
        keep = slice(1, None)
        of_one = other.legs is self.legs
        return Course(
            np.concatenate([self.times, other.times[keep] + shift]),
            np.concatenate([self.poses, other.poses[keep]]),
            np.concatenate([self.leg, other.leg[keep] + (0 if of_one else len(self.legs))]),
            self.legs if of_one else self.legs + other.legs,
            self.pushes if of_one else self.pushes + other.pushes,
        )

    def check(self, limits: Limits) -> None:
        """Refuses what a robot may not do.

        Raises:
            OutOfLimits: with segment, time and limit.
        """
        for k, pose in enumerate(self.poses):
            if why := limits.outside(pose):
                self._refuse(k, why)
        dt = np.diff(self.times)
        rates = np.diff(self.poses, axis=0) / dt[:, None]
        for name, values, most, unit in (
            ("speed", 1000 * np.linalg.norm(rates[:, :3], axis=1), 1000 * limits.speed, "mm/s"),
            ("turn rate", np.degrees(np.abs(rates[:, 3])), np.degrees(limits.turn_rate), "°/s"),
        ):
            k = int(np.argmax(values))
            if values[k] > most * (1 + SLACK):
                self._refuse(k + 1, f"a {name} of {values[k]:.1f} {unit} is above {most:g} {unit}")
        if limits.arm is not None:
            joints = np.array([limits.arm.joints(pose) for pose in self.poses])
            share = np.abs(np.diff(joints, axis=0)) / dt[:, None] / limits.arm.speeds
            k, joint = (int(n) for n in np.unravel_index(np.argmax(share), share.shape))
            if share[k, joint] > 1 + SLACK:
                rate, most = np.degrees(limits.arm.speeds[joint] * np.array([share[k, joint], 1.0]))
                self._refuse(
                    k + 1, f"the arm's {ORDINALS[joint]} joint at {rate:.1f} °/s is above {most:.1f} °/s"
                )
        # From rest to rest; across a sample, over half of the time on each side.
        ends = np.zeros((1, 3))
        change = np.linalg.norm(np.diff(np.concatenate([ends, rates[:, :3], ends]), axis=0), axis=1)
        around = 0.5 * (np.append(dt, 0.0) + np.insert(dt, 0, 0.0))
        k = int(np.argmax(change / around))
        if change[k] / around[k] > limits.acceleration * (1 + SLACK):
            self._refuse(
                k,
                f"an acceleration of {1000 * change[k] / around[k]:.0f} mm/s² is above"
                f" {1000 * limits.acceleration:g} mm/s²",
            )

    def _refuse(self, k: int, why: str) -> None:
        time = float(self.times[k] - self.times[0])
        raise OutOfLimits(f"{self.legs[self.leg[k]]}, {time:.2f} s: {why}")


def planned(plan: Plan, speed: float = 1.0, yaw: float | None = None) -> Course:
    """A plan's way.

    Args:
        speed: in parts of the plan's, above 0 and at most 1.
        yaw: of the hand now; the plan is turned by whole turns to begin near it.

    Raises:
        InputError: for a speed that is not so, a plan without segments, or fingers that differ between its pushes.
    """
    if not 0 < speed <= 1:
        raise InputError(
            "a plan is run at more than 0 and at most 1 times its speed", key="speed", value=speed
        )
    if plan.status != "solved" or not plan.on_table:
        raise InputError(
            "there is no push to run in this plan", hint=plan.reason or "Start and goal are one."
        )
    first = plan.on_table[0]
    for push in plan.on_table:
        if push.fingers.shape != first.fingers.shape or not np.allclose(
            push.fingers, first.fingers, atol=1e-9
        ):
            raise InputError(
                f"the fingers of push {push.push!r} are not those of {first.push!r}",
                hint="A robot holds one tool: give all pushes the same fingers and spacing.",
            )
    listed = [push.name for push in plan.scene.pushes if not isinstance(push, str)]
    listed += [slide.push for slide in plan.slides]
    last = 1 + listed.index(first.push)
    actions = {push.push: 1 + listed.index(push.push) for push in plan.on_table}
    found: Course | None = None
    for number, segment in enumerate(plan.segments):
        if isinstance(segment, TransitSegment):
            name, height, action = "transit", segment.height, last
        else:
            name, height = f"push {segment.push}", np.zeros(len(segment.times))
            action = last = actions[segment.push]
        poses = np.column_stack([segment.pusher[:, :2], height, segment.pusher[:, 2]])
        new = np.append(True, np.diff(segment.times) > SAME_TIME)
        if np.count_nonzero(new) < 2:
            continue
        part = Course(
            segment.times[new] / speed, poses[new], np.zeros(np.count_nonzero(new), dtype=np.intp),
            (f"segment {number} ({name})",), (action,),
        )  # fmt: skip
        found = part if found is None else found.then(part)
    if found is None:
        raise InputError("this plan has no motion", hint="It is damaged; plan anew.")
    if yaw is not None:
        turns = round((yaw - found.poses[0, 3]) / (2 * np.pi))
        found = replace(found, poses=found.poses + np.array([0, 0, 0, 2 * np.pi * turns]))
    return found


def reach_of(plan: Plan) -> float:
    """Of the fingertips from E; 0: one finger, in the middle of the hand [m]."""
    return float(np.max(np.hypot(*plan.on_table[0].fingers.T)))


def alike(plan: Plan) -> tuple[float, ...]:
    """Turns after which the fingertips are where they were, best first [rad]: whole ones; half ones for two that stand
    opposite each other; and any for one, which is round (0)."""
    fingers = plan.on_table[0].fingers
    if reach_of(plan) == 0:
        return TURN, 0.0
    return (TURN, 0.5 * TURN) if np.allclose(fingers, -fingers[::-1], rtol=0, atol=1e-9) else (TURN,)


def in_range(course: Course, limits: Limits, pusher: Pusher, reach: float, steps: Sequence[float]) -> Course:
    """A plan's way whose hand keeps to the range of an arm: where it would leave it before the next lift, it turns in
    the air before.

    Args:
        pusher: whose limits hold in the air. reach: of the fingertips from E [m]. steps: as of alike.
    """
    if limits.arm is None:
        return course
    left = np.array([limits.yaws(pose) for pose in course.poses]) - course.poses[:, 3:]
    up = np.concatenate([[0], course.poses[:, 2] > pusher.lift - SAME_HEIGHT, [0]])
    rises, falls = np.flatnonzero(np.diff(up) > 0), np.flatnonzero(np.diff(up) < 0) - 1
    crosses = rises < falls
    begins, ends = [0, *falls[crosses]], [*rises[crosses], len(course.poses) - 1]
    found, turned = course.part(0, 0, 0.0), 0.0
    for k, (first, last) in enumerate(zip(begins, ends, strict=True)):
        low, high = np.max(left[first : last + 1, 0]), np.min(left[first : last + 1, 1])
        turn = turn_within(float(low) - turned, float(high) - turned, *steps)
        if k > 0:
            over = course.part(ends[k - 1], first, turned)
            if turn != 0:
                air = _over(over.poses[[0, -1]] + np.array([[0.0] * 4, [0, 0, 0, turn]]), pusher, reach)
                over = replace(over, times=air.times, poses=air.poses, leg=air.leg + over.leg[-1])
            found = found.then(over)
        turned += turn
        stays = course.part(first, last, turned)
        found = found.then(stays) if k > 0 else stays
    return found


def approach(tool: Array, goal: Array, lift: float, pusher: Pusher, reach: float) -> Course:
    """Up, over, and down, from rest to rest: from where the tool is to a pose (x, y, height, yaw), by as many turns.

    Args:
        lift: height at which it goes over [m]; from higher up it goes at its own height.
        pusher: whose limits hold. reach: of the fingertips from E [m].
    """
    high = max(lift, float(tool[2]), float(goal[2]))
    stops = np.array([tool, [*tool[:2], high, tool[3]], [*goal[:2], high, goal[3]], goal])
    moves = np.append(True, np.any(np.diff(stops, axis=0) != 0, axis=1))
    if np.count_nonzero(moves) < 2:
        return Course(
            np.array([0.0, 1e-3]), np.array([tool, tool]), np.zeros(2, np.intp), ("approach",), (-1,)
        )
    return _over(stops[moves], pusher, reach)


def _over(stops: Array, pusher: Pusher, reach: float) -> Course:
    """From stop to stop, poses (n, 4), at rest at each."""
    way = PusherPath(stops[:, [0, 1, 3]], stops[:, 2], reach).segment(pusher, np.zeros(3))
    poses = np.column_stack([way.pusher[:, :2], way.height, way.pusher[:, 2]])
    return Course(way.times, poses, np.zeros(len(way.times), np.intp), ("approach",), (-1,))


def within(pusher: Pusher, limits: Limits, speed: float = 1.0) -> Pusher:
    """A scene's pusher, slower, and no faster than a robot may be."""
    return replace(
        pusher,
        speed=min(speed * pusher.speed, limits.speed),
        acceleration=min(speed**2 * pusher.acceleration, limits.acceleration),
        turn_rate=min(speed * pusher.turn_rate, limits.turn_rate),
        travel_speed=min(speed * pusher.travel_speed, limits.speed),
        travel_acceleration=min(speed**2 * pusher.travel_acceleration, limits.acceleration),
    )
