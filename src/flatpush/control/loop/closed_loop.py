"""A controller, a sensor and a simulated object in a loop."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry import transform
from ...geometry.pose import Array
from .controller import AbstractController, ControllerState
from .limits import Limits
from .sensor import AbstractSensor


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
        told: called at every tick with the time and the controller's state.
    """
    if not (np.isfinite(duration) and duration > 0):
        raise InputError("a duration is positive and finite", key="duration", value=duration)
    dt = 1 / controller.rate
    world, state, eyes = plant.start(start, hand), controller.start(begin), sensor.start()
    times, objects, hands, heights, modes, contacts = [], [], [], [], [], []
    notes: dict[str, float] = {}
    outcome = ""
    lifted: Array | None = None  # X_WE while the hand is in the air
    for k in range(int(np.ceil(duration * controller.rate)) + 1):
        time = begin + k * dt
        at = world.hand if lifted is None else lifted
        eyes = sensor.expose(eyes, time, world.object, at)
        eyes, frames = sensor.arrived(eyes, time)
        state, command = controller.step(state, frames[-1] if frames else None, time)
        times.append(time)
        objects.append(world.object)
        hands.append(at)
        heights.append(command.height)
        modes.append(state.mode)
        contacts.append(world.modes[0] if lifted is None else "separation")
        if state.note:
            notes.setdefault(state.note, time)
        if told is not None:
            told(time, state)
        if state.outcome or world.outcome:
            outcome = state.outcome or world.outcome
            break
        if command.height > 0:
            lifted = np.asarray(at, dtype=float) + dt * command.velocity
        else:
            if lifted is not None:
                world, lifted = plant.start(world.object, lifted), None
            world = plant.step(world, command.velocity, dt)
    if not outcome:
        why = f": {state.note}" if state.note else ""
        outcome = f"out of time after {duration:.1f} s, {state.mode}{why}"
    said = tuple((t, text) for text, t in notes.items())
    return ClosedLoopRun(
        np.array(times),
        np.array(objects),
        np.array(hands),
        np.array(heights),
        tuple(modes),
        tuple(contacts),
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
