"""What differs from the plan in a disturbed run: start, friction, limit surface, centre of friction, loads."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arguments import is_finite
from ..errors import InputError
from ..friction.draws import SurfaceDraws, draw_loads
from ..friction.surface import LimitSurface
from ..problem import Scene
from ..problem.mechanics import surface_of, true_surface
from ..problem.scene import Model


@dataclass(frozen=True)
class Noise:
    """How much a run may differ from the plan.

    Attributes:
        position: of the start, standard deviation of each axis [m].
        angle: of the start, standard deviation [rad].
        friction: between finger and object, relative standard deviation.
        friction_range: the coefficient is uniform between these two instead.
        df: degrees of freedom of a Wishart draw of the limit surface, an ellipsoid or a quartic; None: as modelled.
        centre: of friction, standard deviation of each axis [m].
        loads: of the feet, each uniform within 1 ± this share of its nominal value.

    Raises:
        InputError: for what is negative or not finite.
    """

    position: float = 0.0005
    angle: float = float(np.deg2rad(0.5))
    friction: float = 0.1
    friction_range: tuple[float, float] | None = None
    df: float | None = None
    centre: float = 0.0
    loads: float = 0.0

    def __post_init__(self) -> None:
        for name in ("position", "angle", "friction", "centre", "loads"):
            value = getattr(self, name)
            if not (is_finite(value) and value >= 0):
                raise InputError("noise is a finite number, 0 or more", key=name, value=value)
        if self.loads >= 1:
            raise InputError(
                "the loads of feet vary by a part from 0 to below 1", key="loads", value=self.loads
            )
        if self.friction_range is not None:
            low, high = self.friction_range
            if not (is_finite(low) and is_finite(high) and 0 <= low <= high):
                raise InputError(
                    "a range of friction is two numbers, 0 ≤ low ≤ high",
                    key="friction_range",
                    value=(low, high),
                )
        if self.df is not None and not (is_finite(self.df) and self.df >= 3):
            raise InputError("a Wishart draw has at least 3 degrees of freedom", key="df", value=self.df)


class Disturbances:
    """Disturbed scenes of one plan: each is a function of the seed and of its number alone.

    Raises:
        InputError: if the noise asks for a draw that this object or model has not.
    """

    def __init__(self, scene: Scene, noise: Noise, model: Model = "exact") -> None:
        self.scene, self.noise, self.model = scene, noise, model
        if noise.loads > 0 and not len(scene.object.support.feet[1]):
            raise InputError(
                "only the loads of feet vary one by one",
                key="loads",
                hint="This object's support is spread: shift its centre of friction instead.",
            )
        self._draws = None if noise.df is None else SurfaceDraws(self._nominal(), noise.df)

    def _nominal(self) -> LimitSurface:
        """The surface that Wishart draws are about."""
        if self.model == "local":
            raise InputError(
                "the local model has no random surfaces", key="df", hint="Take ellipsoid or quartic."
            )
        thing = self.scene.object
        if self.model == "exact" and thing.surface is None:
            raise InputError(
                "the exact surface of a support has no Wishart draw",
                key="df",
                hint="Take the model ellipsoid or quartic, or vary the loads and the centre.",
            )
        return (
            true_surface(thing)
            if self.model == "exact"
            else surface_of(thing, self.model, np.array([0.0, 1.0]))
        )

    def scene_of(self, seed: int, run: int) -> Scene:
        """The scene of one run of many: its start and its object are drawn."""
        return self.draw(np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(run,))))

    def draw(self, rng: np.random.Generator) -> Scene:
        """A scene whose start and object are drawn."""
        noise, thing = self.noise, self.scene.object
        start = np.asarray(self.scene.start, dtype=float) + rng.standard_normal(3) * [
            noise.position, noise.position, noise.angle,
        ]  # fmt: skip
        relative = rng.standard_normal()
        if noise.friction_range is None:
            friction = thing.friction * max(0.0, 1 + noise.friction * relative)
        else:
            friction = float(rng.uniform(*noise.friction_range))
        offset = noise.centre * rng.standard_normal(2)
        changes: dict[str, Any] = {"friction": friction}
        if noise.centre > 0 or noise.loads > 0:
            support = thing.support if noise.loads == 0 else draw_loads(thing.support, rng, noise.loads)
            changes["support"] = support.translated(offset)
        if self._draws is not None:
            changes["surface"] = self._draws.draw(rng)
        return replace(self.scene, start=tuple(float(x) for x in start), object=replace(thing, **changes))

    def model_of(self) -> Model:
        """The model under which a disturbed scene moves: a drawn surface is the known one."""
        return self.model if self._draws is None else "exact"
