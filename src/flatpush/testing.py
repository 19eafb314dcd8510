"""Tests for what others write: a robot, held to what `flatpush.execution` expects of one."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from .execution import Clock, Limits, OutOfLimits, Robot, RobotFault, Run, State, Target, WallClock
from .execution.course import Course
from .execution.run import DONE, Cycle, Played, ready, stream
from .geometry.pose import Array

# The test motion: so far aside [m], at most at this share of every limit, in at least so many periods.
ASIDE, SHARE, LEAST = 0.01, 0.25, 60
# In this cycle of it something goes wrong.
WRONG = 25
# A tool that rests stays within this [m] for so many periods, and a resting tool is no faster than this [m/s].
STILL, WATCH, SLOW = 1e-4, 10, 1e-3


class NotConforming(AssertionError):
    """A robot that does not do what one must."""


def check_robot(make: Callable[[], Robot], kill: Callable[[Robot], None] | None = None) -> tuple[str, ...]:
    """Tries all that a robot must keep to, each on a new one; the names of what was tried.

    The tool moves by 10 mm at its height, at a quarter of its limits, and down to the table and back, straight below
    where it stands: the table must be free there.

    Args:
        make: a robot that is not yet entered.
        kill: ends or cuts off what a robot that runs talks to. Default: the connection is said to be lost.

    Raises:
        NotConforming: for the first thing that it does not keep.
    """
    tried = []
    for name, check in _CHECKS.items():
        try:
            check(make, kill)
        except NotConforming as error:
            raise NotConforming(f"{name}: {error}") from error
        tried.append(name)
    return tuple(tried)


def _connects(make: Callable[[], Robot], kill: Callable[[Robot], None] | None) -> None:
    robot = make()
    with robot as entered:
        _need(entered is robot, "__enter__ gives another robot than itself")
        _need(isinstance(robot.limits, Limits), "it has no limits")
        _rests(robot, "it moves when it is connected")
    with _raises("it says where its tool is after it was let go, as if it were connected"):
        ready(robot)


def _follows(make: Callable[[], Robot], kill: Callable[[Robot], None] | None) -> None:
    with make() as robot:
        course = _aside(robot)
        run = _play(course, robot)
        _need(run.outcome == DONE, f"it does not make a slow motion of 10 mm: {run.outcome}")
        seen = np.array([cycle.state.pose for cycle in run.cycles])
        _need(np.ptp(seen[:, 0]) > 0.5 * ASIDE, "it does not move when it is told to")
        for cycle in run.cycles:
            _need(cycle.target.time > 0 and cycle.target.pose.shape == (4,), "send gives no target back")
        _rests(robot, "it does not rest after a motion")


def _limits(make: Callable[[], Robot], kill: Callable[[Robot], None] | None) -> None:
    with make() as robot:
        seen, tool, limits = _Between(robot), ready(robot).pose, robot.limits
        aside = _aside(robot)
        quick = 1.01 * limits.speed / _speed(aside)
        turn = np.array([0, 0, 0, 1.5 * limits.turn_rate * limits.period])
        beside = np.array([limits.workspace[2] - tool[0] + 1e-3, 0, 0, 0])
        above = np.array([0, 0, limits.heights[1] - tool[2] + 1e-3, 0])
        beyond = [
            Course(aside.times, aside.poses + beside, *_rest(aside)),
            Course(aside.times, aside.poses + above, *_rest(aside)),
            Course(aside.times / quick, aside.poses, *_rest(aside)),
            Course(limits.period * np.arange(2.0), np.array([tool, tool + turn]), *_rest(aside, 2)),
        ]
        for course in beyond:
            with _raises("a motion beyond its limits is not refused", OutOfLimits):
                course.check(limits)
                _play(course, seen)
        _need(seen.sent == 0, "something is sent before the limits are compared")


def _late(make: Callable[[], Robot], kill: Callable[[Robot], None] | None) -> None:
    with make() as robot:
        slow = _Late(_clock(robot), 1.5 * robot.limits.age)
        run = _play(_aside(robot), robot, slow)
        _need("late" in run.outcome, f"a late cycle does not end the run: {run.outcome}")
        _rests(robot, "it moves on after a late cycle")


def _old(make: Callable[[], Robot], kill: Callable[[Robot], None] | None) -> None:
    with make() as robot:
        run = _play(_aside(robot), _Between(robot, stale=True))
        # A tool that seems to stand still is soon far from where it was sent.
        ended = " old" in run.outcome or "from where it was sent" in run.outcome
        _need(ended, f"old feedback does not end the run: {run.outcome}")
        _rests(robot, "it moves on after old feedback")


def _fault(make: Callable[[], Robot], kill: Callable[[Robot], None] | None) -> None:
    with make() as robot:
        run = _play(_aside(robot), _Between(robot, fault="a test"))
        _need("a test" in run.outcome and len(run.cycles) == WRONG, "a fault does not end the run at once")
        _rests(robot, "it moves on after a fault")


def _killed(make: Callable[[], Robot], kill: Callable[[Robot], None] | None) -> None:
    robot = make()
    with robot:
        course, between = _aside(robot), _Between(robot, lost=kill is None)
        cycles = 0

        def told(cycle: Cycle) -> None:
            nonlocal cycles
            cycles += 1
            if cycles == WRONG and kill is not None:
                kill(robot)

        run = _play(course, between, told=told)
        _need(run.outcome != DONE, "the run goes on without what the robot talks to")
        after = WRONG + int(np.ceil(robot.limits.age / robot.limits.period)) + 3
        _need(len(run.cycles) <= after, f"it takes {len(run.cycles) - WRONG} cycles to notice")
        robot.stop()


def _stops(make: Callable[[], Robot], kill: Callable[[Robot], None] | None) -> None:
    robot = make()
    with robot:
        robot.stop()
        robot.stop()
        run = _play(_aside(robot), robot)
        _need(run.outcome == DONE, f"it cannot go on after a stop: {run.outcome}")
        robot.stop()
        robot.stop()
        _rests(robot, "it does not rest after a stop")
    robot.stop()


def _interrupted(make: Callable[[], Robot], kill: Callable[[Robot], None] | None) -> None:
    with make() as robot:
        count = 0

        def told(cycle: Cycle) -> None:
            nonlocal count
            count += 1
            if count == WRONG:
                raise KeyboardInterrupt

        with _raises("an interrupt does not come through", KeyboardInterrupt):
            _play(_aside(robot), robot, told=told)
        _rests(robot, "it moves on after an interrupt")


def _logged(make: Callable[[], Robot], kill: Callable[[Robot], None] | None) -> None:
    from .documents import load_robot_log

    with make() as robot, tempfile.TemporaryDirectory() as folder:
        tool, path = ready(robot).pose, Path(folder) / "log.csv"
        down = _swing(robot, np.array([0.0, 0.0, -tool[2], 0.0]), hold=20)
        run = _play(down, robot, log=path)
        _need(run.outcome == DONE, f"it does not go down to the table and back: {run.outcome}")
        rows = load_robot_log(path).runs[0]
        _need(len(rows.times) > 3, "the log has hardly a row")
        apart = np.abs(rows.hands[:, :2] - tool[:2])
        _need(bool(np.max(apart) < robot.limits.deviation), "the log has the tool elsewhere")


_CHECKS = {
    "connects, and nothing moves": _connects,
    "goes where it is sent": _follows,
    "limits are refused before the first command": _limits,
    "a late cycle": _late,
    "old feedback": _old,
    "a fault": _fault,
    "the peer is killed": _killed,
    "stops twice": _stops,
    "an interrupt": _interrupted,
    "the log": _logged,
}


@dataclass
class _Between:
    """A robot with what may go wrong: after a number of cycles its feedback grows old, it has a fault, or is lost."""

    robot: Robot
    stale: bool = False
    fault: str = ""
    lost: bool = False
    sent: int = 0
    kept: State | None = field(default=None)

    @property
    def limits(self) -> Limits:
        return self.robot.limits

    @property
    def clock(self) -> Clock:
        return _clock(self.robot)

    def __enter__(self) -> "_Between":
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def state(self) -> State:
        found = self.robot.state()
        wrong = self.sent >= WRONG
        if wrong and self.lost:
            raise RobotFault("the connection is lost")
        if self.stale:
            self.kept = self.kept if wrong else found
            found = self.kept or found
        return replace(found, fault=self.fault) if wrong and self.fault else found

    def send(self, target: Target) -> Target:
        self.sent += 1
        return self.robot.send(target)

    def stop(self) -> None:
        self.robot.stop()


class _Late:
    """A clock that oversleeps once."""

    def __init__(self, clock: Clock, late: float) -> None:
        self.clock, self.late, self.waits = clock, late, 0

    def now(self) -> float:
        return self.clock.now()

    def wait(self, until: float) -> None:
        self.waits += 1
        self.clock.wait(until + (self.late if self.waits == WRONG else 0.0))


class _raises:
    """Needs an error."""

    def __init__(self, otherwise: str, kind: type[BaseException] = RobotFault) -> None:
        self.otherwise, self.kind = otherwise, kind

    def __enter__(self) -> None: ...

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> bool:
        _need(kind is not None, self.otherwise)
        return kind is not None and issubclass(kind, self.kind)


def _need(good: bool, otherwise: str) -> None:
    if not good:
        raise NotConforming(otherwise)


def _clock(robot: Robot) -> Clock:
    found: Clock = getattr(robot, "clock", None) or WallClock()
    return found


def _rests(robot: Robot, otherwise: str) -> None:
    clock, period = _clock(robot), robot.limits.period
    # What moves needs a while to come to rest: as long as feedback may be old.
    clock.wait(clock.now() + robot.limits.age)
    before = robot.state()
    clock.wait(clock.now() + WATCH * period)
    after = robot.state()
    far = float(np.linalg.norm((after.pose - before.pose)[:3]))
    _need(far < STILL and float(np.linalg.norm(after.twist[:3])) < SLOW, otherwise)


def _swing(robot: Robot, step: Array, hold: int = 0) -> Course:
    """There and back, smoothly."""
    tool, limits = ready(robot).pose, robot.limits
    far = float(np.linalg.norm(step[:3]))
    half = max(
        LEAST / 2 * limits.period,
        0.5 * np.pi * far / (SHARE * limits.speed),
        np.pi * np.sqrt(0.5 * far / (SHARE * limits.acceleration)),
    )
    n = int(np.ceil(half / limits.period))
    out = 0.5 - 0.5 * np.cos(np.pi * np.arange(n + 1) / n)
    share = np.concatenate([out, np.ones(hold), out[-2::-1]])
    poses = tool + share[:, None] * step
    count = len(poses)
    times = np.array(limits.period * np.arange(count), dtype=float)
    return Course(times, poses, np.zeros(count, np.intp), ("test",), (-1,))


def _aside(robot: Robot) -> Course:
    """By 10 mm towards the middle of the workspace."""
    tool, space = ready(robot).pose, robot.limits.workspace
    towards = np.sign(0.5 * (space[0] + space[2]) - tool[0]) or 1.0
    return _swing(robot, np.array([towards * ASIDE, 0.0, 0.0, 0.0]))


def _speed(course: Course) -> float:
    return float(np.max(np.abs(np.diff(course.poses[:, 0])) / np.diff(course.times)))


def _rest(course: Course, count: int | None = None) -> tuple[Any, tuple[str, ...], tuple[int, ...]]:
    return course.leg[:count], course.legs, course.pushes


def _play(
    course: Course,
    robot: Robot,
    clock: Clock | None = None,
    told: Callable[[Cycle], None] | None = None,
    log: Path | None = None,
) -> Run:
    course.check(robot.limits)
    return stream(Played(course, robot.limits.period), robot, clock or _clock(robot), log, told)
