"""The pushes of a scene as cars, or the reason why one is none."""

from dataclasses import dataclass

import numpy as np

from ..contact import Placement
from ..errors import FlatpushError, InputError
from ..geometry import transform
from ..problem import Push, Scene
from ..problem.mechanics import placement_of, surface_of, virtual_contact
from ..problem.scene import Model
from ..steering.car import Car


@dataclass(frozen=True, eq=False)
class PushOption:
    """A push and its car; without a car, `refusal` says why."""

    push: Push
    placement: Placement | None
    car: Car | None
    refusal: str = ""


def push_option(
    scene: Scene, push: Push, model: Model | None = None, margin: float | None = None
) -> PushOption:
    """The car of a push under a model (default: the scene's) with a friction margin (default: the scene's)."""
    placement = None
    try:
        placement = placement_of(scene, push)
        _check_landing(scene, placement)
        contact = virtual_contact(scene, placement)
        distance = float(np.hypot(*contact.point))
        towards = -contact.point / distance if distance > 0 else contact.normal
        surface = surface_of(scene.object, model or scene.planning.model, towards)
        car = Car.of(
            contact,
            surface,
            cof=scene.object.cof,
            pusher=placement.pose,
            margin=scene.planning.friction_margin if margin is None else margin,
        )
    except FlatpushError as error:
        return PushOption(push, placement, None, str(error))
    return PushOption(push, placement, car)


def push_options(scene: Scene) -> tuple[PushOption, ...]:
    """Every push of a scene whose pushes are listed."""
    if scene.pushes == "auto":
        raise InputError("the pushes are not listed yet", key="pushes", hint="See automatic_pushes.")
    return tuple(push_option(scene, push) for push in scene.pushes)


def _check_landing(scene: Scene, placement: Placement) -> None:
    """The fingers land clear of the object, a little back along the push direction."""
    back = transform([0.0, 0.0, placement.pose[2]], [-scene.pusher.approach, 0.0])
    for tip in placement.tips:
        if scene.object.outline.nearest(tip + back).distance < scene.pusher.tip_radius - 1e-9:
            raise InputError(
                "a finger would land on the object",
                value=scene.pusher.approach,
                hint="Use another approach distance.",
            )
