"""The pushes of a scene as cars, or the reason why one is none."""

from dataclasses import dataclass

from ..contact import Placement, two_point_sticks
from ..errors import FlatpushError, InputError
from ..geometry import compose, shift_twist
from ..problem import Push, Scene
from ..problem.mechanics import (
    cone_motions,
    contacts_of,
    placement_of,
    proved_for_set,
    surface_at,
    takes_cone,
    true_surface,
    virtual_contact,
)
from ..problem.scene import Model
from ..steering.car import Car
from .transits import backs_off

SLACK = 1e-6


@dataclass(frozen=True, eq=False)
class PushOption:
    """A push and its car, or the error that says why it has none."""

    push: Push
    placement: Placement | None
    car: Car | None
    error: FlatpushError | None = None

    @property
    def refusal(self) -> str:
        """Why there is no car; empty where there is one. To name what breaks a proof takes time, once it is read."""
        return "" if self.error is None else str(self.error)


def push_option(
    scene: Scene, push: Push, model: Model | None = None, margin: float | None = None, *, quick: bool = False
) -> PushOption:
    """The car of a push under a model (default: the scene's) with a friction margin (default: the scene's).

    quick is for comparing many places: the car of two fingers may then turn a little less tightly.
    """
    placement = None
    try:
        placement = placement_of(scene, push)
        _check_landing(scene, placement)
        contact = virtual_contact(scene, placement)
        surface = surface_at(scene, contact, model)
        if push.fingers == 1 and proved_for_set(scene):
            raise InputError(
                "one finger cannot be proved for a set of tables",
                key="planning.proof",
                hint="Use two fingers, or proof: nominal and feedback.",
            )
        if takes_cone(scene, push.fingers):
            contacts = contacts_of(scene, placement)
            motions = cone_motions(scene, placement, surface, margin, quick=quick)
            car = Car.of_two(contacts, surface, motions, cof=scene.object.cof, pusher=placement.pose)
            return PushOption(push, placement, car)
        car = Car.of(
            contact,
            surface,
            cof=scene.object.cof,
            pusher=placement.pose,
            margin=scene.planning.friction_margin if margin is None else margin,
        )
        _check_composite(scene, placement, car, model or scene.planning.model)
    except FlatpushError as error:
        return PushOption(push, placement, None, error.with_traceback(None))
    return PushOption(push, placement, car)


def push_options(scene: Scene) -> tuple[PushOption, ...]:
    """Every push of a scene whose pushes are listed.

    Raises:
        InputError: for a scene whose pushes are "auto".
    """
    if scene.pushes == "auto":
        raise InputError("the pushes are not listed yet", key="pushes", hint="See automatic_pushes.")
    return tuple(push_option(scene, push) for push in scene.pushes)


def _check_composite(scene: Scene, placement: Placement, car: Car, model: Model) -> None:
    """Two fingers must be able to make every motion of the car together, if its model is what the table does.

    Under parallel normals they always can; on curved sides the virtual contact between them may promise too much.
    """
    if len(placement.tips) == 1 or model != "exact":
        return
    contacts, surface = contacts_of(scene, placement), true_surface(scene.object)
    for name, twist in (
        ("left turn", car.left),
        ("straight motion", car.straight),
        ("right turn", car.right),
    ):
        inside = (
            twist * (1 - SLACK) + car.straight * SLACK
        )  # the edges of a car without margin lie on the cone
        if not two_point_sticks(contacts, surface, shift_twist(inside, scene.object.cof)):
            raise FlatpushError(
                f"its {name} needs more friction than the two fingers have together; more margin or a flatter place"
                " would help"
            )


def _check_landing(scene: Scene, placement: Placement) -> None:
    """The fingers land clear of the object, a little back along the push direction."""
    back = compose(placement.pose, [-scene.pusher.approach, 0.0, 0.0])
    if not backs_off(scene.object.outline, placement, back, scene.pusher.tip_radius):
        raise InputError(
            f"a finger would land on the object, {1000 * scene.pusher.approach:.4g} mm back from where it pushes",
            hint="Another approach distance would help.",
        )
