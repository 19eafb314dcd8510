"""Robots that are none: a tool that is always where it was sent, alone (`dry-run`) or with an object (`sim`)."""

from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry import compose
from ..geometry.pose import Array
from ..problem import Plan
from ..simulation.plant import Plant, PlantState
from .addresses import Address
from .clock import SimulatedClock
from .robot import Limits, RobotFault, State, Target

# A simulated tool waits so far behind the plan's first pose [m].
BEHIND = 0.05
# Lower than this the fingertips are beside the object, not above it [m].
BESIDE = 1e-4


class DryRun:
    """A tool that goes straight from target to target, in a time of its own.

    Args:
        home: where it is at the start, (x, y, height, yaw).
        limits: what may be asked for.
    """

    real = False

    def __init__(self, home: ArrayLike, limits: Limits | None = None) -> None:
        self.limits = limits or Limits()
        self.clock = SimulatedClock(self._advance)
        self._pose, self._twist = np.array(home, dtype=float), np.zeros(4)
        self._target: Target | None = None
        self._inside = False

    def __enter__(self) -> Self:
        self._inside = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
        self._inside = False

    def state(self) -> State:
        self._check()
        return State(self._pose, self._twist, self.clock.now())

    def send(self, target: Target) -> Target:
        self._check()
        self._target = target
        return target

    def stop(self) -> None:
        self._target, self._twist = None, np.zeros(4)

    def _check(self) -> None:
        if not self._inside:
            raise RobotFault("the robot is not connected")

    def _advance(self, until: float) -> None:
        """Straight to the target, and there it stays."""
        now, target = self.clock.now(), self._target
        if target is None or target.time <= now:
            self._twist = np.zeros(4)
            return
        end = min(until, target.time)
        before, rate = self._pose, (target.pose - self._pose) / (target.time - now)
        self._pose = target.pose if end == target.time else before + (end - now) * rate
        self._twist = rate if until <= target.time else np.zeros(4)
        self._moved(before, rate, end - now)

    def _moved(self, before: Array, rate: Array, dt: float) -> None:
        """From a pose with a twist for a time."""


@dataclass(frozen=True)
class Unknown:
    """What a simulated robot has that the plan does not know.

    Attributes:
        start: the object is off by this at the start [m, m, rad].
        noise: standard deviations of the object's start, each axis [m] and angle [rad].
        tool: standard deviation of where the fingertips truly are, each axis [m], once for the run.
        friction: at the fingertips; None: the scene's.
        seed: of what is drawn.
    """

    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    noise: tuple[float, float] = (0.0, 0.0)
    tool: float = 0.0
    friction: float | None = None
    seed: int = 0

    @classmethod
    def of(cls, address: Address) -> Self:
        """The options start=MM,MM,DEG, noise=MM,DEG, tool=MM, friction=μ and seed=N of an address."""
        shift, spread = address.numbers("start", 3, (0, 0, 0)), address.numbers("noise", 2, (0, 0), least=0)
        (tool,), (friction,), (seed,) = (
            address.numbers(key, 1, usual, least=0)
            for key, usual in (("tool", (0,)), ("friction", (np.nan,)), ("seed", (0,)))
        )
        if seed != round(seed):
            raise InputError("seed takes a whole number", source=address.text, value=seed)
        return cls(
            (shift[0] / 1000, shift[1] / 1000, float(np.deg2rad(shift[2]))),
            (spread[0] / 1000, float(np.deg2rad(spread[1]))),
            tool / 1000,
            None if np.isnan(friction) else friction,
            round(seed),
        )

    def draw(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """By how much the object's start (3,) and the fingertips (2,) are off."""
        spread = np.array([self.noise[0], self.noise[0], self.noise[1]])
        return rng.standard_normal(3) * spread + self.start, rng.standard_normal(2) * self.tool


class SimRobot(DryRun):
    """The same with an object on the table, in the contact simulator.

    Args:
        plan: whose object and fingers it has. unknown: in what they differ. home, limits: as of DryRun.
    """

    def __init__(
        self,
        plan: Plan,
        unknown: Unknown | None = None,
        home: ArrayLike | None = None,
        limits: Limits | None = None,
    ) -> None:
        super().__init__(home_of(plan) if home is None else home, limits)
        unknown = unknown or Unknown()
        off, tool = unknown.draw(np.random.default_rng(unknown.seed))
        self._beside = np.append(tool, 0.0)
        scene = plan.scene
        self._plant = Plant(
            scene.object, plan.on_table[0].fingers, scene.pusher.tip_radius, friction=unknown.friction
        )
        self.object: Array = scene.start_pose + off
        self._touching: PlantState | None = None

    @property
    def contacts(self) -> tuple[str, ...]:
        """Contact mode of each finger."""
        lifted = ("separation",) * len(self._plant.fingers)
        return lifted if self._touching is None else self._touching.modes

    def _moved(self, before: Array, rate: Array, dt: float) -> None:
        if max(before[2], self._pose[2]) > BESIDE:
            self._touching = None
            return
        if self._touching is None:
            self._touching = self._plant.start(self.object, before[[0, 1, 3]] + self._beside)
        self._touching = self._plant.step(self._touching, rate[[0, 1, 3]], dt)
        self.object = self._touching.object
        if self._touching.outcome:
            raise RobotFault(f"the object is {self._touching.outcome}")


def home_of(plan: Plan) -> Array:
    """Where a simulated tool waits: lifted, behind the plan's first pose."""
    back = compose(plan.segments[0].pusher[0], [-BEHIND, 0.0, 0.0])
    return np.array([back[0], back[1], plan.scene.pusher.lift, back[2]])


def dry_run(address: Address, plan: Plan) -> DryRun:
    """`dry-run`"""
    limits = address.limits(Limits())
    address.check_used(port=False)
    return DryRun(home_of(plan), limits)


def sim(address: Address, plan: Plan) -> SimRobot:
    """`sim?noise=MM,DEG&start=MM,MM,DEG&tool=MM&friction=μ&seed=N`"""
    limits, unknown = address.limits(Limits()), Unknown.of(address)
    address.check_used(port=False)
    return SimRobot(plan, unknown, limits=limits)
