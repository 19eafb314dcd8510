"""A plan on a robot: one loop that owns the clock, watches limits and feedback in every cycle, and always stops."""

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from ..control import AbstractController, AbstractSensor, ClosedLoopRun, ControllerState, Measurement
from ..control.loop.frames import Seen
from ..control.loop.limits import braking, turn_within
from ..errors import InputError
from ..geometry import compose
from ..geometry.pose import Array
from ..problem import Plan
from ..simulation import Claim, verify
from .clock import Clock, WallClock
from .course import SLACK, Course, alike, approach, in_range, planned, reach_of, within
from .log import LogFault, open_log
from .robot import Limits, Robot, RobotFault, State, Target

#: Outcome of a run in which the whole plan was made, open loop.
DONE = "done"
# A measured pose may be outside of the limits by so much [m].
MEASURED = 0.002
# A controller's tick is a whole number of the robot's periods, to so much of one.
WHOLE = 1e-6
# Feedback of the tool that is kept to tell where it was when a frame was exposed [s].
MEMORY = 2.0
# One finger in the air has so much of its range left to both sides, where there is as much [rad]; few pushes turn more.
RESERVE = math.pi
# It begins and ends its turn in the air within this time, less than it takes to come down [s].
GENTLE = 0.25
# A controller has so many times the plan's duration, and so much more [s]: it looks, and may land again.
PATIENCE, MORE = 3.0, 200.0


class Unverified(InputError):
    """A plan that fails its verification; `failed` holds the claims."""

    def __init__(self, failed: Sequence[Claim]) -> None:
        self.failed = tuple(failed)
        names = ", ".join(claim.name for claim in self.failed[:3]) + (", …" if len(self.failed) > 3 else "")
        super().__init__(f"the plan fails verification ({names}); nothing was moved")


@dataclass(frozen=True, eq=False)
class Cycle:
    """What happened in one cycle.

    Attributes:
        time: since the first cycle [s].
        target: what was sent, as the robot says. state: the feedback before.
        object: X_WO as last seen or known, shape (3,); None: never seen.
        leg: what the tool does, such as "segment 1 (push long edge)". push: number of the push in the scene, or -1.
        mode: of the controller, or "plan".
        off: distance of the tool from the last target [m].
        late: how much later than due it began [s].
        contact: mode of the first finger, where a simulated robot knows it; else "".
    """

    time: float
    target: Target
    state: State
    object: Array | None
    leg: str
    push: int
    mode: str
    off: float
    late: float
    contact: str = ""


@dataclass(frozen=True, eq=False)
class Run:
    """What a robot did.

    Attributes:
        outcome: "done" (open loop), "arrived" (a controller), or why it stopped.
        cycles: every cycle in which something was sent.
        notes: what a controller said, each once, with the time when it first did [s].
    """

    outcome: str
    cycles: tuple[Cycle, ...] = ()
    notes: tuple[tuple[float, str], ...] = ()

    @property
    def object(self) -> Array | None:
        """Where the object was last seen, X_WO; None: never."""
        return self.cycles[-1].object if self.cycles else None

    def as_followed(self) -> ClosedLoopRun:
        """The same as of a closed loop, which figures draw: from the first cycle in which the object is known.

        Raises:
            InputError: if the object was never seen.
        """
        seen = [cycle for cycle in self.cycles if cycle.object is not None]
        if not seen:
            raise InputError("there is nothing to draw: the object was not seen in this run")
        tools = np.array([cycle.state.pose for cycle in seen])
        return ClosedLoopRun(
            np.array([cycle.time for cycle in seen]),
            np.array([cycle.object for cycle in seen]),
            tools[:, [0, 1, 3]],
            tools[:, 2],
            tuple(cycle.mode for cycle in seen),
            tuple(cycle.contact for cycle in seen),
            self.outcome,
            self.notes,
        )

    @property
    def off(self) -> float:
        """Greatest distance of the tool from where it was sent [m]."""
        return max((cycle.off for cycle in self.cycles), default=0.0)


@dataclass(frozen=True, eq=False)
class Wanted:
    """What a motion wants next: pose and twist (4,), or an outcome instead."""

    pose: Array
    twist: Array
    leg: str = ""
    push: int = -1
    mode: str = "plan"
    note: str = ""
    outcome: str = ""


class Motion(Protocol):
    """Gives the next target, cycle by cycle."""

    def step(self, now: float, state: State) -> Wanted:
        """For the end of the cycle that begins now."""
        ...


def run(
    plan: Plan,
    robot: Robot,
    controller: AbstractController[ControllerState] | None = None,
    eyes: AbstractSensor | None = None,
    log: str | os.PathLike[str] | None = None,
    *,
    speed: float = 1.0,
    clock: Clock | None = None,
    told: Callable[[Cycle], None] | None = None,
) -> Run:
    """Runs a plan on a robot that is entered: `with robot: run(plan, robot)`.

    The plan is verified and its whole way compared with the robot's limits before the first command. Then the tool
    rises, goes over and lands, and pushes as planned, or as a controller says that sees the object. Every cycle asks
    for the feedback and compares it and the next target with the limits. Whatever ends the run, the robot is stopped.

    Args:
        controller: its tick is a whole number of the robot's periods.
        eyes: what sees the object; a simulated one is shown the robot's object. Frames whose pusher is not finite get
            the tool's pose from the robot's feedback at their exposure.
        log: a file ending in .csv (rows as of recorded runs) or .mcap.
        speed: a fraction of the plan's, above 0 and at most 1.
        clock: default: the robot's own, or the machine's.
        told: called after every cycle.

    Raises:
        Unverified: for a plan that fails its verification.
        OutOfLimits: before the first command, with segment, time and limit.
        InputError: for what makes no sense together.
        RobotFault: for a robot that is not ready at the start. A later fault is the run's outcome.
    """
    if plan.status == "solved" and (failed := verify(plan).failed):
        raise Unverified(failed)
    time = clock or getattr(robot, "clock", None) or WallClock()
    if controller is None:
        motion: Motion = Played(way(plan, robot, speed), robot.limits.period)
    else:
        if eyes is None:
            raise InputError("a controller needs eyes", hint="Give what sees the object.")
        patience = PATIENCE * plan.duration / speed + MORE
        begins, turn_rate = to_controller(plan, robot, speed), 0.0
        if robot.limits.arm is not None and reach_of(plan) > 0:
            controller = controller.with_yaws(robot.limits.yaws(begins.poses[-1]), alike(plan))
        elif robot.limits.arm is not None and plan.scene.pusher.turns:
            turn_rate = within(plan.scene.pusher, robot.limits, speed).turn_rate
        motion = Controlled(begins, controller, eyes, robot, patience, turn_rate)
    names = (plan.scene.object.name,)
    return stream(motion, robot, time, log, told, names)


def way(plan: Plan, robot: Robot, speed: float = 1.0) -> Course:
    """From where the tool is, and then as planned; within the robot's limits.

    Raises:
        OutOfLimits: as Course.check. RobotFault: for a robot that is not ready.
    """
    tool = ready(robot).pose
    pusher, reach = within(plan.scene.pusher, robot.limits, speed), reach_of(plan)
    course = in_range(planned(plan, speed, float(tool[3])), robot.limits, pusher, reach, alike(plan))
    whole = approach(tool, course.poses[0], pusher.lift, pusher, reach).then(course)
    whole.check(robot.limits)
    return whole


def to_controller(plan: Plan, robot: Robot, speed: float = 1.0) -> Course:
    """From where the tool is to above the place from which a controller begins: lifted, behind the first contact.

    Raises:
        OutOfLimits: as way, for the plan's own way too: a controller's is near it.
    """
    whole = way(plan, robot, speed)
    tool, pusher = ready(robot).pose, within(plan.scene.pusher, robot.limits, speed)
    behind = compose(plan.on_table[0].pusher[0], [-2 * pusher.approach, 0.0, 0.0])
    yaw = whole.poses[np.argmax(whole.leg > 0), 3]
    above = np.array([behind[0], behind[1], max(pusher.lift, float(tool[2])), yaw])
    found = approach(tool, above, pusher.lift, pusher, reach_of(plan))
    found.check(robot.limits)
    return found


def slowed(plan: Plan, limits: Limits, speed: float = 1.0) -> Plan:
    """A plan whose scene's pusher is slower, for a controller that shall keep to a robot's limits."""
    return replace(plan, scene=replace(plan.scene, pusher=within(plan.scene.pusher, limits, speed)))


def ready(robot: Robot) -> State:
    """The feedback of a robot that is ready.

    Raises:
        RobotFault: if it is not.
    """
    state = robot.state()
    if state.fault:
        raise RobotFault(f"the robot is not ready: {state.fault}")
    if not (np.all(np.isfinite(state.pose)) and np.all(np.isfinite(state.twist))):
        raise RobotFault("the robot does not know where its tool is")
    return state


class Played:
    """A course as it is, one period of it in each cycle, however late the cycles come."""

    def __init__(self, course: Course, period: float) -> None:
        self.course, self.period, self.count = course, period, 0

    def step(self, now: float, state: State) -> Wanted:
        self.count += 1
        time = self.count * self.period
        pose, twist, leg = self.course.at(time)
        over = time >= self.course.duration + 2 * self.period
        outcome = DONE if over else ""
        return Wanted(pose, twist, self.course.legs[leg], self.course.pushes[leg], outcome=outcome)


class Controlled:
    """A course to where a controller begins, and then what the controller says, held for as long as it means it to be.

    Args:
        patience: the controller has so long [s]. The others are as of run.
        turn_rate: at which one finger, which is round, turns back into the range of its arm while it is in the air
            [rad/s], whatever the controller says; 0: the hand turns as the controller says.

    Raises:
        InputError: for a controller whose tick is no whole number of the robot's periods.
    """

    def __init__(
        self,
        course: Course,
        controller: AbstractController[ControllerState],
        eyes: AbstractSensor,
        robot: Robot,
        patience: float,
        turn_rate: float = 0.0,
    ) -> None:
        self.patience, self.turn_rate = patience, turn_rate
        self.played, self.controller, self.eyes, self.robot = (
            Played(course, robot.limits.period),
            controller,
            eyes,
            robot,
        )
        ticks = 1 / (controller.rate * robot.limits.period)
        self.ticks = round(ticks)
        if self.ticks < 1 or abs(ticks - self.ticks) > WHOLE * ticks:
            raise InputError(
                f"a tick of the controller is a whole number of the robot's periods of {robot.limits.period:g} s",
                key="rate",
                value=controller.rate,
                hint=f"Take {1 / (max(self.ticks, 1) * robot.limits.period):g} Hz.",
            )
        self.seeing = eyes.start()
        self.control: ControllerState | None = None
        self.pose, self.twist, self.count = course.poses[-1].copy(), np.zeros(4), 0
        # By how much the tool is turned against the controller's hand [rad], and how fast that grows.
        self.turned, self.turning = 0.0, 0.0
        self.tool: list[tuple[float, Array]] = []

    def step(self, now: float, state: State) -> Wanted:
        self.tool.append((state.stamp, state.pose - np.array([0.0, 0.0, 0.0, self.turned])))
        while self.tool[0][0] < now - MEMORY:
            self.tool.pop(0)
        if self.control is None:
            wanted = self.played.step(now, state)
            if not wanted.outcome:
                return wanted
            self.control = self.controller.start(now)
            self.control = replace(self.control, seen=Seen(height=float(self.pose[2])))
        period = self.robot.limits.period
        if self.count % self.ticks == 0 and (outcome := self._tick(now, state)):
            return Wanted(self.pose, np.zeros(4), mode=self.control.mode, outcome=outcome)
        if self.count * period > self.patience:
            late = f"out of time after {self.patience:.0f} s, {self.control.mode}"
            return Wanted(self.pose, np.zeros(4), outcome=late)
        self.count += 1
        self.pose = self.pose + period * self.twist
        self.turned += period * self.turning
        return Wanted(
            self.pose, self.twist, self.control.mode, mode=self.control.mode, note=self.control.note
        )

    def _tick(self, now: float, state: State) -> str:
        """Asks the controller; its outcome, or ""."""
        assert self.control is not None
        expose, known = getattr(self.eyes, "expose", None), getattr(self.robot, "object", None)
        if expose is not None and known is not None:
            self.seeing = expose(self.seeing, now, known, self.tool[-1][1][[0, 1, 3]])
        self.seeing, frames = self.eyes.arrived(self.seeing, now)
        frame = self._with_tool(frames[-1]) if frames else None
        self.control, command = self.controller.step(self.control, frame, now)
        hold = self.ticks * self.robot.limits.period
        vx, vy, spin = (float(v) for v in command.velocity)
        twist = np.array([vx, vy, (command.height - float(self.pose[2])) / hold, spin])
        change = float(np.linalg.norm((twist - self.twist)[:3])) / hold
        most = self.robot.limits.acceleration
        if change > most * (1 + SLACK):
            raise RobotFault(
                f"the controller asks for an acceleration of {1000 * change:.0f} mm/s², above {1000 * most:g} mm/s²"
            )
        if self.turn_rate > 0 and max(command.height, float(self.pose[2])) > 0:
            twist[3] = self._in_the_air(float(twist[2]), hold)
        self.twist, self.turning = twist, float(twist[3]) - spin
        return self.control.outcome

    def _in_the_air(self, climb: float, hold: float) -> float:
        """The rate at which a round finger turns: it rests, but where a push may turn it out of its arm's range."""
        low, high = (float(end - self.pose[3]) for end in self.robot.limits.yaws(self.pose))
        turn = 0.0 if climb < 0 else turn_within(low + RESERVE, high - RESERVE, 0.0)
        gain, last = self.turn_rate / GENTLE, float(self.twist[3])
        rate = math.copysign(min(self.turn_rate, braking(abs(turn), gain, hold)), turn)
        return float(np.clip(rate, last - gain * hold, last + gain * hold))

    def _with_tool(self, frame: Measurement) -> Measurement:
        """With the tool's pose at the exposure, where the frame has none."""
        if np.all(np.isfinite(frame.pusher)):
            return frame
        stamps = np.array([stamp for stamp, _ in self.tool])
        poses = np.array([pose for _, pose in self.tool])
        pusher = np.array([np.interp(frame.time, stamps, poses[:, k]) for k in (0, 1, 3)])
        return replace(frame, pusher=pusher)


@dataclass
class _Watch:
    """Of feedback and targets, against the limits."""

    robot: Robot
    last: Array | None = None
    notes: dict[str, float] = field(default_factory=dict)

    def feedback(self, state: State, now: float, off: float) -> str:
        """Why a robot with this feedback, so far from where it was sent [m], must stop, or ""."""
        limits = self.robot.limits
        if state.fault:
            return f"the robot has a fault: {state.fault}"
        if not np.isfinite(state.stamp) or now - state.stamp > limits.age:
            return f"the feedback is {now - state.stamp:.3f} s old, more than {limits.age:g} s"
        if outside := limits.outside(state.pose, MEASURED):
            return f"the tool is where it may not be: {outside}"
        if off > limits.deviation:
            return (
                f"the tool is {1000 * off:.1f} mm from where it was sent, more than"
                f" {1000 * limits.deviation:g} mm"
            )
        return ""

    def off(self, state: State) -> float:
        return 0.0 if self.last is None else math.dist(state.pose[:3], self.last[:3])

    def target(self, wanted: Wanted) -> str:
        """Why a target must not be sent, or ""."""
        limits, speed = self.robot.limits, math.hypot(*wanted.twist[:3])
        if outside := limits.outside(wanted.pose):
            return outside
        if speed > limits.speed * (1 + SLACK):
            return f"a speed of {1000 * speed:.1f} mm/s is above {1000 * limits.speed:g} mm/s"
        if abs(wanted.twist[3]) > limits.turn_rate * (1 + SLACK):
            turn, most = np.degrees([abs(wanted.twist[3]), limits.turn_rate])
            return f"a turn rate of {turn:.1f} °/s is above {most:g} °/s"
        return ""


def stream(
    motion: Motion,
    robot: Robot,
    clock: Clock,
    log: str | os.PathLike[str] | None = None,
    told: Callable[[Cycle], None] | None = None,
    names: tuple[str, ...] = ("",),
) -> Run:
    """Streams a motion to a robot until it has an outcome, or a limit, the feedback or the robot ends it.

    Args:
        names: of the object, for the log. The others are as run's.
    """
    cycles: list[Cycle] = []
    watch, period, age = _Watch(robot), robot.limits.period, robot.limits.age
    outcome = "interrupted"
    with open_log(log, names[0]) as book:
        begin = due = clock.now()
        try:
            while True:
                clock.wait(due)
                now = clock.now()
                late, state = now - due, robot.state()
                off = watch.off(state)
                outcome = f"a cycle came {late:.3f} s late, more than {age:g} s" if late > age else ""
                outcome = outcome or watch.feedback(state, now, off)
                if outcome:
                    break
                wanted = motion.step(now, state)
                if wanted.note:
                    watch.notes.setdefault(wanted.note, now - begin)
                outcome = wanted.outcome or watch.target(wanted)
                if outcome:
                    break
                sent = robot.send(Target(now + period, wanted.pose, wanted.twist))
                watch.last = sent.pose
                seen = _object(motion, robot)
                contact = getattr(robot, "contacts", ("",))[0]
                leg, push, mode = wanted.leg, wanted.push, wanted.mode
                cycle = Cycle(now - begin, sent, state, seen, leg, push, mode, off, late, contact)
                cycles.append(cycle)
                book.write(cycle)
                if told is not None:
                    told(cycle)
                # A cycle that was late is not made up for: the next would come too soon.
                due = max(due, now - 0.25 * period) + period
        except (RobotFault, LogFault) as fault:
            outcome = str(fault)
        finally:
            try:
                robot.stop()
            finally:
                book.end(outcome or "interrupted")
    return Run(outcome, tuple(cycles), tuple((t, text) for text, t in watch.notes.items()))


def _object(motion: Motion, robot: Robot) -> Array | None:
    """X_WO as the robot knows it, or as it was last seen."""
    known = getattr(robot, "object", None)
    if known is not None:
        return np.asarray(known, dtype=float)
    control = getattr(motion, "control", None)
    if control is not None and control.seen.frame is not None:
        return np.asarray(control.seen.frame.object, dtype=float)
    return None
