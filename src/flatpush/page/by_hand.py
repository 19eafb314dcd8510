"""The object under a finger that somebody moves: the plant, step by step as the page asks for it."""

import json
import math
from collections.abc import Mapping

import numpy as np

from ..documents import parse_scene
from ..errors import InputError
from ..geometry import compose, inverse, log, rotate, shift_twist, transform
from ..geometry.pose import Array
from ..simulation.plant import Plant
from ..view import words
from ..view.table import MM
from .in_mm import refuse_files
from .values import number_of, numbers_of, scene_of

LONGEST_WAY, LONGEST_TIME = 0.2, 0.5  # of one step: a page that was asleep does not make up for it [m], [s]
DIGITS = 7  # of a place [mm]: less would part finger and object
STILL = 1e-5  # a speed below this is none [m/s]
DOING = {
    "sticking": words.STICKS,
    "sliding_left": words.SLIDES_LEFT,
    "sliding_right": words.SLIDES_RIGHT,
    "separation": words.OFF,
    "rest": words.RESTS,
}


class ByHand:
    """Steps of one finger; the plant of the last scene is kept."""

    def __init__(self) -> None:
        self._key = ""
        self._plant: Plant | None = None

    def step(self, value: Mapping[str, object]) -> dict[str, object]:
        """The object after the finger went straight from one place to another.

        Args:
            value: the scene; object: its pose [mm, mm, rad]; way: two places of the finger [mm]; seconds: how long it
                took [s].

        Returns:
            the object's pose; mode: what the contact did, in words; point: the contact [mm], or None where the finger
            does not touch; twist of the centre of friction [mm/s, mm/s, °/s] and the force of the finger, a direction
            in W, with its moment about the centre of friction [mm]; outcome: why nothing moves, or "".

        Raises:
            InputError: for anything that is not that.
        """
        plant = self._plant_of(scene_of(value))
        pose = numbers_of(value, "object", 3) / [MM, MM, 1.0]
        start, end = numbers_of(value, "way", 4).reshape(2, 2) / MM
        seconds = min(number_of(value, "seconds"), LONGEST_TIME)
        if seconds <= 0:
            raise InputError("a step takes a positive time", key="seconds", value=seconds)
        way = end - start
        way *= min(1.0, LONGEST_WAY / max(float(np.hypot(*way)), 1e-12))
        # Where it only lands it must not stand on the object; on its way it keeps what rounding takes away.
        state = plant.start(pose, [*start, 0.0], push_out=bool(np.any(way)))
        if state.outcome:
            return {"kind": "pushed", "object": _shown(pose), "mode": "", "outcome": state.outcome}
        after = plant.step(state, [*(way / seconds), 0.0], seconds)
        cof = plant.thing.cof
        twist = shift_twist(log(compose(inverse(pose), after.object)) / seconds, cof)
        moved = bool(np.any(np.abs(twist * [1.0, 1.0, plant.thing.outline.size]) > STILL))
        found: dict[str, object] = {
            "kind": "pushed",
            "object": _shown(after.object),
            "mode": DOING.get(after.modes[0], after.modes[0]),
            "outcome": after.outcome,
            "point": None,
            "finger": (MM * after.hand[:2]).round(DIGITS).tolist(),
        }
        if moved:
            wrench = plant.surface.wrench(twist)
            size = float(np.hypot(*wrench[:2]))
            found |= {
                "point": (MM * transform(after.object, after.points[0])).round(4).tolist(),
                "twist": [
                    *(MM * rotate(after.object[2], twist[:2])).round(3).tolist(),
                    round(math.degrees(twist[2]), 3),
                ],
                "force": rotate(after.object[2], wrench[:2] / size).round(5).tolist(),
                "moment": round(MM * float(wrench[2]) / size, 3),
            }
        return found

    def _plant_of(self, scene: Mapping[str, object]) -> Plant:
        key = json.dumps(
            {name: part for name, part in scene.items() if name in ("object", "pusher", "planning")}
        )
        if self._plant is None or key != self._key:
            refuse_files(scene)
            asked = parse_scene(scene)
            model = "exact" if asked.planning.model == "local" else asked.planning.model
            self._plant = Plant(asked.object, [[0.0, 0.0]], asked.pusher.tip_radius, model=model)
            self._key = key
        return self._plant


def _shown(pose: Array) -> list[float]:
    x, y, angle = (pose * [MM, MM, 1.0]).tolist()
    return [round(x, DIGITS), round(y, DIGITS), round(angle, DIGITS + 2)]
