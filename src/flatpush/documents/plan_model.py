"""The structure of a plan document, in SI."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag

from .scene_model import Finite, Part, Text

Time = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Vector2 = Annotated[list[Finite], Field(min_length=2, max_length=2)]
Vector3 = Annotated[list[Finite], Field(min_length=3, max_length=3)]


class ArcPart(Part):
    """A piece of a push in which the object keeps one body twist."""

    turn: Literal["left", "straight", "right"] = Field(description="left, straight or right.")
    twist: Vector3 = Field(
        description="The body twist [vx, vy, ω] in O at O's origin, averaged over the arc."
    )
    duration: Time = Field(description="Seconds.")
    cost: Finite = Field(description="In the unit of the plan's cost.")


class PushSegmentPart(Part):
    """The object pushed at one place."""

    kind: Literal["push"]
    push: Text = Field(description="The name of the push.")
    word: str = Field(description="Such as LSR.")
    arcs: list[ArcPart] = Field(description="The arcs in order.")
    times: list[Time] = Field(min_length=1, description="Seconds, from 0.")
    object: list[Vector3] = Field(description="Poses of the object at the times.")
    pusher: list[Vector3] = Field(description="Poses of the pusher at the times.")
    fingers: list[Vector2] = Field(min_length=1, max_length=2, description="Fingertip centres in E.")


class SensitivityPart(Part):
    """How far the outline's farthest point ends elsewhere, about, by what differs from the plan."""

    place: Time = Field(description="If the object starts beside: m per m.")
    turn: Time = Field(description="If it starts turned: m per rad.")
    friction: Time = Field(description="By the coefficient between finger and object: m.")
    centre: Time = Field(description="If the centre of friction lies beside: m per m.")


class SlideSegmentPart(Part):
    """The object pushed by one finger that goes straight, whatever the contact does."""

    kind: Literal["slide"]
    push: Text = Field(description="The name of the slide.")
    times: list[Time] = Field(min_length=1, description="Seconds, from 0.")
    object: list[Vector3] = Field(
        description="Poses of the object at the times, as the simulator rolls them out."
    )
    pusher: list[Vector3] = Field(description="Poses of the pusher at the times.")
    fingers: list[Vector2] = Field(min_length=1, max_length=1, description="The fingertip centre in E.")
    end: Vector3 = Field(description="The object's pose after it, as predicted.")
    sensitivity: SensitivityPart = Field(description="How far it ends elsewhere.")


class TransitSegmentPart(Part):
    """The pusher alone."""

    kind: Literal["transit"]
    times: list[Time] = Field(min_length=1, description="Seconds, from 0.")
    pusher: list[Vector3] = Field(description="Poses of the pusher at the times.")
    height: list[Finite] = Field(description="Heights above the table at the times; 0 is on it.")


def _kind(value: Any) -> str:
    kind = value.get("kind") if isinstance(value, dict) else getattr(value, "kind", None)
    return f"<{kind}>" if kind in ("transit", "slide") else "<push>"


SegmentForm = Annotated[
    Annotated[PushSegmentPart, Tag("<push>")]
    | Annotated[SlideSegmentPart, Tag("<slide>")]
    | Annotated[TransitSegmentPart, Tag("<transit>")],
    Discriminator(_kind),
]


class CarPart(Part):
    """How a push steers, in O."""

    left_centre: Vector2 = Field(description="The centre of its tightest left turn.")
    right_centre: Vector2 = Field(description="The centre of its tightest right turn.")
    straight: Vector2 = Field(description="The unit direction of its straight motion.")


class TubePartModel(Part):
    """Where the object is in one push, from wherever in the start region it began."""

    push: str = Field(description="Name of the push.")
    gap: Finite = Field(
        description="Between a finger at its place and the side, or how deep it stands in it."
    )
    travel: Finite = Field(description="Of the hand, straight on, after which both fingers hold the object.")
    offset: Finite = Field(description="Of the object from there on, along the side, to either side at most.")
    end: Vector2 = Field(description="Half the sides of the box about the planned end of the push.")
    clearance: Finite | None = Field(default=None, description="That is kept during the push.")


class SetBoundsPart(Part):
    """The set of tables, fingers and places for which the margins of a set are."""

    loads: Finite = Field(description="The share by which loads may differ from the nominal ones.")
    friction: Finite = Field(description="The least coefficient of the fingers.")
    offset: Finite = Field(description="Of the object along the side that is pushed, to either side at most.")


class SetWorstPart(Part):
    """The table of a set that comes nearest to letting the object slip, and what would give way."""

    number: int = Field(description="Which of the plan's pushes, from 0.")
    push: str = Field(description="Its name.")
    arc: int = Field(description="Which of its arcs, from 0.")
    offset: Finite = Field(description="Of the object along the side, to the left as seen along the push.")
    depth: Finite = Field(description="Of its wrench under the face, by the nominal wrench's size.")
    gives_way: str = Field(description="What happens beyond that face, in words.")
    face: Vector3 = Field(
        description="Its inward normal, for forces and the torque about the centre of friction."
    )
    points: list[Vector2] = Field(description="Feet or middles of patches.")
    loads: list[Finite] = Field(description="Of each, in parts of the whole.")


class CertificatePart(BaseModel):
    """What was proved or measured; null where it does not apply. A later version may know more keys."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True)

    goal_error: Vector3 = Field(description="The final pose less the goal.")
    cost: Finite = Field(description="In the unit of the scene's cost.")
    duration: Time = Field(description="Seconds.")
    friction_margin: Finite | None = Field(default=None, description="The fraction of μ that can be lost.")
    friction_margin_degrees: Finite | None = Field(default=None, description="The same as an angle.")
    spacing_margin: Finite | None = Field(default=None, description="The part of the spacing to lose.")
    motion_cone_margin_degrees: Finite | None = Field(
        default=None, description="From the pusher's velocity to the edge of the motion cone."
    )
    curvature_margin: Finite | None = Field(default=None, description="1 - turn / the tightest turn.")
    composite_margin: Finite | None = Field(default=None, description="Of both contacts together.")
    uniqueness_margin: Finite | None = Field(default=None, description="Turning centres beyond the object.")
    model_offset: Finite | None = Field(default=None, description="Of the believed line of force.")
    set_margin: Finite | None = Field(
        default=None,
        description="Least depth in the fingers' cone on all tables of the object's uncertainty.",
    )
    set_loads: Finite | None = Field(
        default=None, description="The largest share by which loads may differ so that the plan still holds."
    )
    set_bounds: SetBoundsPart | None = Field(default=None, description="That set.")
    set_worst: SetWorstPart | None = Field(
        default=None, description="Its table that comes nearest to letting the object slip."
    )
    set_uniqueness: Finite | None = Field(
        default=None,
        description="How far motions other than sticking are from being possible; above 0, none is.",
    )
    set_end: Vector2 | None = Field(
        default=None, description="Half the sides of the box about the planned end that the object ends in."
    )
    set_clearance: Finite | None = Field(
        default=None, description="Clearance with any offset along the fingers."
    )
    tube: list[TubePartModel] | None = Field(
        default=None, description="Of each push, with a start region: where the object is."
    )
    growth: Finite | None = Field(default=None, description="The factor by which a small error grows.")
    sensitivity: SensitivityPart | None = Field(
        default=None, description="Of a plan with slides: how far it ends elsewhere."
    )
    clearance: Finite | None = Field(default=None, description="To obstacles and bounds.")
    cars: dict[str, CarPart] = Field(default_factory=dict, description="Of each push used, by its name.")
    warnings: list[str] = Field(default=[], description="In words.")


class NoCertificatePart(Part):
    """What stands for a certificate without a plan."""


CertificateForm = Annotated[
    Annotated[CertificatePart, Tag("<full>")] | Annotated[NoCertificatePart, Tag("<none>")],
    Discriminator(
        lambda value: "<none>" if value == {} or isinstance(value, NoCertificatePart) else "<full>"
    ),
]


class PlanModel(Part):
    """A plan: what was asked, and what is answered."""

    flatpush: Literal["plan/1"] = Field(description="The version of this document: plan/1.")
    status: Literal["solved", "no_plan"] = Field(description="solved or no_plan.")
    reason: str = Field(default="", description="Why there is no plan, and what to try.")
    scene: dict[str, Any] = Field(description="The scene as resolved, in SI: a scene document.")
    scene_digest: str = Field(default="", description="The SHA-256 of the scene; older plans have none.")
    cost: Finite | None = Field(description="In the unit of the scene's cost; null without a plan.")
    duration: Time = Field(description="Seconds.")
    run: dict[str, Any] = Field(default_factory=dict, description="Version and planning time; not compared.")
    segments: list[SegmentForm] = Field(description="Pushes, slides and transits in order.")
    certificate: CertificateForm = Field(
        default=NoCertificatePart(), description="What was proved or measured; empty without a plan."
    )
