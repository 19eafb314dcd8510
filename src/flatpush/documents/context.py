"""The units of a scene document that is being read, and refusals that name its file, key and value."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry.pose import Array
from . import scene_model as m
from .reading import join
from .refusals import description, value_at

PER_METRE = {"m": 1.0, "cm": 100.0, "mm": 1000.0}


@dataclass(frozen=True)
class Context:
    """A scene document that is being read. Keys are relative to the scene.

    Attributes:
        source: the file, for messages and for relative paths.
        prefix: where the scene stands in the file.
        raw: the document as plain values.
        per_metre: units of length in a metre.
        degrees: whether angles are in degrees.
    """

    source: str
    prefix: str
    raw: dict[str, Any]
    per_metre: float
    degrees: bool

    @property
    def folder(self) -> Path:
        return Path(self.source).parent if self.source else Path()

    @property
    def length_unit(self) -> str:
        return next(unit for unit, per_metre in PER_METRE.items() if per_metre == self.per_metre)

    def lengths(self, values: ArrayLike) -> Array:
        # A quotient, which is the nearest float for whole numbers; 9 * 0.001 is not 0.009.
        return np.array(values, dtype=float) / self.per_metre

    def angle(self, value: float) -> float:
        return float(np.deg2rad(value)) if self.degrees else value

    def refuse(self, rule: str, key: str, *, hint: str, value: object = None) -> InputError:
        shown = self.value(key) if value is None else value
        return InputError(rule, source=self.source, key=join(self.prefix, key), value=shown, hint=hint)

    def value(self, key: str) -> object:
        steps: list[str | int] = []
        for part in key.split("."):
            name, *places = part.split("[")
            steps += [name, *(int(place[:-1]) for place in places)]
        return value_at(self.raw, steps)

    @contextmanager
    def at(self, key: str) -> Iterator[None]:
        """What is refused inside is refused at this key, or at the more exact one that the refusal names."""
        try:
            yield
        except InputError as error:
            where = error.key if error.key.startswith(f"{key}.") else key
            where = _RENAMED.get(where, where)
            rule = error.rule
            if error.source:  # of another file, which this one names
                where = f"{key}.file"
                rule = f"{': '.join(part for part in (error.source, error.key) if part)}: {rule}"
                if error.value is not None:
                    rule += f" ({error.value})"
            shown = self.value(where)
            raise InputError(
                rule,
                source=self.source,
                key=join(self.prefix, where),
                value=error.value if shown is None else shown,
                hint=error.hint or description(m.SceneModel, where),
            ) from None


_RENAMED = {
    "planning.friction_margin": "planning.margin.friction",
    "planning.clearance": "planning.margin.clearance",
}
