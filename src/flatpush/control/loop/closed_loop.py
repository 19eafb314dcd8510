"""A controller, a sensor and a simulated object in a loop."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...geometry.pose import Array
from ...simulation.plant import Plant
from .controller import AbstractController
from .sensor import AbstractSensor


@dataclass(frozen=True, eq=False)
class ClosedLoopRun:
    """What happened, tick by tick.

    Attributes:
        times: shape (n,) [s]. object, pusher: X_WO and X_WE, shape (n, 3).
        modes: of the controller in each tick. contacts: of the first finger in the plant.
        outcome: the controller's, or "out of time", or why the plant stopped.
        notes: what the controller said, each once, with the time when it first did.
    """

    times: Array
    object: Array
    pusher: Array
    modes: tuple[str, ...]
    contacts: tuple[str, ...]
    outcome: str
    notes: tuple[tuple[float, str], ...] = ()


def drive(
    controller: AbstractController[Any],
    plant: Plant,
    start: ArrayLike,
    hand: ArrayLike,
    sensor: AbstractSensor,
    duration: float,
    *,
    begin: float = 0.0,
    told: Callable[[float, Any], None] | None = None,
) -> ClosedLoopRun:
    """Runs the loop from an object at X_WO and a hand at X_WE until the controller has an outcome or time is out.

    Args:
        sensor: a SimulatedSensor is shown the plant at every tick.
        duration: at most so long [s]. begin: time of the first tick [s].
        told: called at every tick with the time and the controller's state.
    """
    if not (np.isfinite(duration) and duration > 0):
        raise InputError("a duration is positive and finite", key="duration", value=duration)
    dt = 1 / controller.rate
    world, state, eyes = plant.start(start, hand), controller.start(begin), sensor.start()
    expose = getattr(sensor, "expose", None)
    times, objects, hands, modes, contacts = [], [], [], [], []
    notes: dict[str, float] = {}
    outcome = "out of time"
    up = False
    for k in range(int(np.ceil(duration * controller.rate)) + 1):
        time = begin + k * dt
        if expose is not None:
            eyes = expose(eyes, time, world.object, world.hand)
        eyes, frames = sensor.arrived(eyes, time)
        state, command = controller.step(state, frames[-1] if frames else None, time)
        times.append(time)
        objects.append(world.object)
        hands.append(world.hand)
        modes.append(state.mode)
        contacts.append("separation" if up else world.modes[0])
        if state.note:
            notes.setdefault(state.note, time)
        if told is not None:
            told(time, state)
        if state.outcome or world.outcome:
            outcome = state.outcome or world.outcome
            break
        if command.height > 0:
            turned = np.asarray(world.hand, dtype=float) + dt * command.velocity
            world = type(world)(world.object, turned, world.modes, world.points, world.gaps, "")
            up = True
        else:
            if up:
                world = plant.start(world.object, world.hand)
                up = False
            world = plant.step(world, command.velocity, dt)
    said = tuple((t, text) for text, t in notes.items())
    return ClosedLoopRun(
        np.array(times), np.array(objects), np.array(hands), tuple(modes), tuple(contacts), outcome, said
    )
