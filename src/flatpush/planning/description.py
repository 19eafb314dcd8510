"""What a scene's friction means for each of its pushes, under every model and every assumed pressure."""

from dataclasses import dataclass, replace

import numpy as np

from ..errors import FlatpushError
from ..problem import Object, Push, Scene
from ..problem.mechanics import divergence_length, takes_cone
from ..problem.scene import MODELS, Model
from ..steering.car import Car
from .candidates import automatic_pushes
from .options import PushOption, push_option

MIDDLE = "middle"


@dataclass(frozen=True, eq=False)
class PushDescription:
    """One push of a scene, without margin.

    Attributes:
        push: the push; option: its car under the scene's model, or the refusal.
        cars: car, or refusal in words, under each model and, as "exact, uniform" and "exact, outline", under the
            exact surface for uniform pressure and for pressure along the outline. Of two fingers with their composite
            cone also, as "middle", that of the virtual contact between them under the scene's model.
        divergence: L [m]: a small error of one finger grows e-fold per L of travel; nan without a contact.
    """

    push: Push
    option: PushOption
    cars: dict[str, Car | str]
    divergence: float


def describe(scene: Scene) -> tuple[PushDescription, ...]:
    """Every listed push, or every automatic candidate (those that cannot steer included)."""
    if scene.pushes == "auto":
        found, refused = automatic_pushes(scene)
        pushes = (*found, *(o.push for o in refused))
    else:
        pushes = scene.pushes
    assumed = {word: _with_support(scene, word) for word in ("uniform", "outline")}
    between = replace(scene, planning=replace(scene.planning, two_finger="middle"))
    described = []
    for push in pushes:
        option = push_option(scene, push, margin=0.0)
        cars: dict[str, Car | str] = {model: _car(scene, push, model) for model in MODELS}
        for word, other in assumed.items():
            cars[f"exact, {word}"] = _car(other, push, "exact")
        if takes_cone(scene, push.fingers):
            cars[MIDDLE] = _car(between, push, scene.planning.model)
        length = divergence_length(scene.object, option.car.contact) if option.car else float("nan")
        described.append(PushDescription(push, option, cars, length))
    return tuple(described)


def _car(scene: Scene, push: Push, model: Model) -> Car | str:
    try:
        option = push_option(scene, push, model, margin=0.0)
    except FlatpushError as error:
        return str(error)
    return option.car if option.car is not None else option.refusal


def _with_support(scene: Scene, word: str) -> Scene:
    """The same object with an assumed pressure and no known surface."""
    thing = Object(scene.object.outline, word, scene.object.friction, None, scene.object.name)
    return replace(scene, object=thing)


def turning_radii(description: PushDescription) -> dict[str, float]:
    """Radius of the flat point under each model [m]; nan where the push cannot steer."""
    return {
        key: car.radius if isinstance(car, Car) else float(np.nan) for key, car in description.cars.items()
    }
