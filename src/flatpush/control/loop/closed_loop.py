"""A controller, a sensor and a simulated object in a loop."""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from itertools import count, islice
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry import transform
from ...geometry.pose import Array
from .controller import AbstractController, ControllerState
from .limits import Limits
from .sensor import AbstractSensor

# Where a hand in the air leaves an object alone that is moved meanwhile [m].
ASIDE = 10.0


class World(Protocol):
    """Where a simulated object and the hand are."""

    @property
    def object(self) -> Array:
        """X_WO, shape (3,)."""
        ...

    @property
    def modes(self) -> tuple[str, ...]:
        """Contact mode of each finger, in words of your own."""
        ...

    @property
    def hand(self) -> Array:
        """X_WE, shape (3,)."""
        ...

    @property
    def outcome(self) -> str:
        """ "" while all is well; anything else ends the run."""
        ...


WorldT = TypeVar("WorldT", bound=World)
StateT = TypeVar("StateT", bound=ControllerState)


class Table(Protocol[WorldT]):
    """What a controller is tried on: a simulation.plant.Plant, or one of your own."""

    def start(self, object_: ArrayLike, hand: ArrayLike) -> WorldT:
        """The world with the object at X_WO and the hand at X_WE, on the table."""
        ...

    def step(self, state: WorldT, velocity: ArrayLike, dt: float) -> WorldT:
        """The world after a time dt [s] in which the hand moves with a velocity in W (vx, vy, yaw rate)."""
        ...


@dataclass(frozen=True, eq=False)
class ClosedLoopRun:
    """What happened, tick by tick.

    Attributes:
        times: shape (n,) [s]. object, pusher: X_WO and X_WE, shape (n, 3). heights: of the pusher at the end
            of each tick, shape (n,) [m].
        modes: of the controller in each tick. contacts: of the first finger in the plant.
        outcome: the controller's, or "out of time …" with what it was doing, or why the plant stopped.
        notes: what the controller said, each once, with the time when it first did [s].
    """

    times: Array
    object: Array
    pusher: Array
    heights: Array
    modes: tuple[str, ...]
    contacts: tuple[str, ...]
    outcome: str
    notes: tuple[tuple[float, str], ...] = ()


@dataclass(frozen=True, eq=False)
class Tick(Generic[StateT]):
    """One tick of the loop: its time [s], X_WO and X_WE, the pusher's height at its end [m], the controller's state,
    the contact of the first finger, and the outcome or ""."""

    time: float
    object: Array
    pusher: Array
    height: float
    state: StateT
    contact: str
    outcome: str


def ticks(
    controller: AbstractController[StateT],
    plant: Table[WorldT],
    start: ArrayLike,
    hand: ArrayLike,
    sensor: AbstractSensor,
    begin: float = 0.0,
) -> Generator[Tick[StateT], ArrayLike | None, None]:
    """The loop of drive, tick by tick, until there is an outcome.

    What is sent to it is a pose X_WO to which somebody moves the object after that tick; fingers on the table stay
    outside of it.
    """
    dt = 1 / controller.rate
    world, state, eyes = plant.start(start, hand), controller.start(begin), sensor.start()
    lifted: Array | None = None  # X_WE while the hand is in the air
    for k in count():
        time = begin + k * dt
        at = world.hand if lifted is None else lifted
        eyes = sensor.expose(eyes, time, world.object, at)
        eyes, frames = sensor.arrived(eyes, time)
        state, command = controller.step(state, frames[-1] if frames else None, time)
        contact = world.modes[0] if lifted is None else "separation"
        outcome = state.outcome or world.outcome
        moved = yield Tick(time, world.object, at, command.height, state, contact, outcome)
        if outcome:
            return
        if moved is not None:
            there = np.asarray(moved, dtype=float)
            world = plant.start(there, at if lifted is None else there + np.array([ASIDE, 0.0, 0.0]))
        if command.height > 0:
            lifted = np.asarray(at, dtype=float) + dt * command.velocity
        else:
            if lifted is not None:
                world, lifted = plant.start(world.object, lifted), None
            world = plant.step(world, command.velocity, dt)


def drive(
    controller: AbstractController[StateT],
    plant: Table[WorldT],
    start: ArrayLike,
    hand: ArrayLike,
    sensor: AbstractSensor,
    duration: float,
    *,
    begin: float = 0.0,
    told: Callable[[float, StateT], None] | None = None,
) -> ClosedLoopRun:
    """Runs the loop from an object at X_WO and a hand at X_WE until the controller has an outcome or time is out.

    Args:
        sensor: it is shown the plant at every tick.
        duration: at most so long [s]. begin: time of the first tick [s].
        told: called at every tick with the time [s] and the controller's state.

    Raises:
        InputError: for a duration that is not positive and finite.
    """
    if not (np.isfinite(duration) and duration > 0):
        raise InputError("a duration is positive and finite", key="duration", value=duration)
    most = int(np.ceil(duration * controller.rate)) + 1
    made: list[Tick[StateT]] = []
    notes: dict[str, float] = {}
    for tick in islice(ticks(controller, plant, start, hand, sensor, begin), most):
        made.append(tick)
        if tick.state.note:
            notes.setdefault(tick.state.note, tick.time)
        if told is not None:
            told(tick.time, tick.state)
    last = made[-1].state
    outcome = made[-1].outcome
    if not outcome:
        why = f": {last.note}" if last.note else ""
        outcome = f"out of time after {duration:.1f} s, {last.mode}{why}"
    said = tuple((t, text) for text, t in notes.items())
    return ClosedLoopRun(
        np.array([tick.time for tick in made]),
        np.array([tick.object for tick in made]),
        np.array([tick.pusher for tick in made]),
        np.array([tick.height for tick in made]),
        tuple(tick.state.mode for tick in made),
        tuple(tick.contact for tick in made),
        outcome,
        said,
    )


def limits_used(run: ClosedLoopRun, limits: Limits) -> dict[str, float]:
    """The greatest share of each limit, by the differences of where the fingertips were at the ticks.

    Returns:
        speed, acceleration (of the fastest fingertip on the table), travel_speed, travel_acceleration (in the air, with
        the climb, and between a tick on the table and one in the air) and turn_rate.
    """
    if len(run.times) < 3:
        return dict.fromkeys(
            ("speed", "acceleration", "travel_speed", "travel_acceleration", "turn_rate"), 0.0
        )
    dt = float(run.times[1] - run.times[0])
    height = np.concatenate([[0.0], run.heights[:-1]])  # at the beginning of each tick
    flat = np.array([transform(pose, limits.tips) for pose in run.pusher])
    tips = np.concatenate([flat, np.repeat(height[:, None, None], flat.shape[1], axis=1)], axis=2)
    speeds = np.diff(tips, axis=0) / dt
    speed = np.max(np.linalg.norm(speeds, axis=2), axis=1)
    acceleration = np.max(np.linalg.norm(np.diff(speeds, axis=0) / dt, axis=2), axis=1)
    up = (height[1:] > 0) | (height[:-1] > 0)
    either = up[1:] | up[:-1]
    return {
        "speed": float(np.max(speed[~up], initial=0)) / limits.speed,
        "acceleration": float(np.max(acceleration[~either], initial=0)) / limits.acceleration,
        "travel_speed": float(np.max(speed[up], initial=0)) / limits.travel_speed,
        "travel_acceleration": float(np.max(acceleration[either], initial=0)) / limits.travel_acceleration,
        "turn_rate": float(np.max(np.abs(np.diff(run.pusher[:, 2])))) / dt / limits.turn_rate,
    }
