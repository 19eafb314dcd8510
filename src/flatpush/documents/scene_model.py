"""The structure of a scene document, in the units of its file. What a description says is also the hint of an
error."""

import re
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import PydanticCustomError

# No length or angle of a file is beyond this in any unit; it keeps products of lengths finite.
LARGEST = 1e9

Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Text = Annotated[str, Field(min_length=1)]
Point = Annotated[list[Number], Field(min_length=2, max_length=2)]
Pose = Annotated[list[Number], Field(min_length=3, max_length=3)]
# What is not the word is a number, or refused as one.
NumberOrFree = Annotated[
    Annotated[Literal["free"], Tag("<word>")] | Annotated[Number, Tag("<number>")],
    Discriminator(lambda value: "<word>" if value == "free" else "<number>"),
]
Goal = Annotated[list[NumberOrFree], Field(min_length=3, max_length=3)]
Row = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Matrix = Annotated[list[Row], Field(min_length=3, max_length=3)]
Coefficients = Annotated[list[Finite], Field(min_length=15, max_length=15)]
Fingers = Annotated[int, Field(ge=1, le=2)]


class Part(BaseModel):
    """A mapping whose keys are all known."""

    # Only the document's own model is built, with all its parts, when it is first used.
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: object) -> object:
        if isinstance(data, dict):
            refuse_unknown(data, list(cls.model_fields))
        return data


def refuse_unknown(data: dict[str, object], known: list[str]) -> None:
    for key in data:
        if key not in known:
            raise PydanticCustomError("unknown_key", "unknown key", {"key": key, "known": known})


def forms(
    what: str,
    groups: tuple[tuple[str, ...], ...],
    *,
    word: bool = False,
    listed: str = "",
    others: tuple[str, ...] = (),
) -> tuple[Discriminator, BeforeValidator]:
    """What tells apart the forms that a value may take: a word, a list, or a mapping by the keys that it has.

    The tags stand in angle brackets, so that the path of an error is readable once they are removed.

    Args:
        what: the value's name with its article.
        groups: the keys of each mapping by which it is known.
        word: whether a word is a form.
        listed: the tag of a list; empty if a list is no form.
        others: keys that any mapping may have.
    """
    keys = [key for group in groups for key in group]
    accepted = (BaseModel, *([str] if word else []), *([list] if listed else []))

    def form(value: str | list[object] | dict[str, object] | BaseModel) -> str:
        if isinstance(value, str):
            return "<word>"
        if isinstance(value, list):
            return f"<{listed}>"
        given = value if isinstance(value, dict) else value.model_dump(exclude_unset=True)
        return next(f"<{group[0]}>" for group in groups if any(key in given for key in group))

    def check(value: object) -> object:
        if isinstance(value, dict):
            held = [group for group in groups if any(key in value for key in group)]
            if len(held) > 1:
                rule = f"{what} takes only one of " + " and ".join(" with ".join(group) for group in held)
                raise PydanticCustomError("form", "{rule}", {"rule": rule})
            if len(held) == 1:
                return value
            refuse_unknown(value, [*keys, *others])
        elif isinstance(value, accepted):
            return value
        raise PydanticCustomError("form", "{rule}", {"rule": f"{what} does not have this form"})

    return (Discriminator(form), BeforeValidator(check))


def unstated(description: str) -> Any:
    """A key whose default depends on the units of the file; the reader fills it in."""
    return Field(default_factory=float, description=description)


class UnitsPart(Part):
    """The units of every number in this file, except those of a surface, which are SI."""

    length: Literal["m", "cm", "mm"] = Field(default="m", description="m, cm or mm.")
    angle: Literal["rad", "deg"] = Field(default="rad", description="rad or deg.")


class CirclePart(Part):
    """A circle by its radius."""

    circle: Positive = Field(description="A radius, greater than 0.")
    centre: Point = Field(default=[0.0, 0.0], description="A point [x, y]; the origin if left out.")


class RoundObstaclePart(Part):
    """A round obstacle."""

    circle: Positive = Field(description="A radius, greater than 0.")
    centre: Point = Field(description="A point [x, y].")


class ShapeFilePart(Part):
    """A drawing, by its path relative to this file."""

    file: Text = Field(description="The path of an SVG or DXF file or a bitmap, relative to this one.")
    layer: Text | None = Field(
        default=None, description="The layer, id or label of the outline; all that is visible if left out."
    )
    origin: Annotated[
        Annotated[Literal["centroid", "drawing"], Tag("<word>")] | Annotated[Point, Tag("<point>")],
        *forms("an origin", (), word=True, listed="point"),
    ] = Field(
        default="drawing",
        description="Where the object's frame begins: centroid, drawing, or a point [x, y] of the drawing, y up.",
    )
    turn: Number = Field(default=0.0, description="By what angle the drawing is turned, counter-clockwise.")
    pixel: Positive | None = Field(default=None, description="The side of a pixel; of bitmaps only.")


class FeetPart(Part):
    """Feet at points."""

    points: list[Annotated[list[Number], Field(min_length=3, max_length=3)]] = Field(
        min_length=1, description="A list of [x, y, weight]; of the weights only the ratios count."
    )


class DiscPart(Part):
    """Uniform pressure over a disc."""

    disc: Positive = Field(description="A radius, greater than 0.")
    centre: Point = Field(default=[0.0, 0.0], description="A point [x, y]; the origin if left out.")


class RingPart(Part):
    """Uniform pressure along a circle."""

    ring: Positive = Field(description="A radius, greater than 0.")
    centre: Point = Field(default=[0.0, 0.0], description="A point [x, y]; the origin if left out.")


class PadPart(Part):
    """Uniform pressure inside a polygon other than the outline."""

    polygon: list[Point] = Field(description="A list of [x, y] corners.")


class RimPart(Part):
    """Uniform pressure along a closed polygon other than the outline."""

    outline: list[Point] = Field(description="A list of [x, y] corners.")


class EllipsoidPart(Part):
    """H(F) = FᵀAF."""

    ellipsoid: Matrix = Field(
        description="The symmetric positive-definite matrix A, [[...], [...], [...]], in SI."
    )


class QuarticPart(Part):
    """A homogeneous polynomial of degree four."""

    quartic: Coefficients = Field(
        description="15 numbers in SI: x⁴ y⁴ z⁴ x³y x³z y³x y³z z³x z³y x²y² x²z² y²z² x²yz y²xz z²xy."
    )


class SurfaceFilePart(Part):
    """A surface document, by its path relative to this file."""

    file: Text = Field(description="The path of a surface document (JSON), relative to this file.")


OutlineForm = Annotated[
    Annotated[list[Point], Tag("<corners>")]
    | Annotated[CirclePart, Tag("<circle>")]
    | Annotated[ShapeFilePart, Tag("<file>")],
    *forms(
        "an outline",
        (("circle",), ("file",)),
        listed="corners",
        others=("centre", "layer", "origin", "turn", "pixel"),
    ),
]
ObstacleForm = Annotated[
    Annotated[list[Point], Tag("<corners>")] | Annotated[RoundObstaclePart, Tag("<circle>")],
    *forms("an obstacle", (("circle",),), listed="corners", others=("centre",)),
]
SupportForm = Annotated[
    Annotated[Literal["uniform", "outline", "unknown"], Tag("<word>")]
    | Annotated[FeetPart, Tag("<points>")]
    | Annotated[DiscPart, Tag("<disc>")]
    | Annotated[RingPart, Tag("<ring>")]
    | Annotated[PadPart, Tag("<polygon>")]
    | Annotated[RimPart, Tag("<outline>")],
    *forms(
        "a support",
        (("points",), ("disc",), ("ring",), ("polygon",), ("outline",)),
        word=True,
        others=("centre",),
    ),
]
SurfaceForm = Annotated[
    Annotated[EllipsoidPart, Tag("<ellipsoid>")]
    | Annotated[QuarticPart, Tag("<quartic>")]
    | Annotated[SurfaceFilePart, Tag("<file>")],
    *forms("a surface", (("ellipsoid",), ("quartic",), ("file",))),
]


UNIT = re.compile(r"[+-]?[0-9]+(?:\.[0-9]+)? ?(m|cm|mm|deg|rad|°)", re.ASCII)
PER_CENT = re.compile(r"([+-]?[0-9]+(?:\.[0-9]+)?) ?%", re.ASCII)


def _share(value: object) -> object:
    """A share that is written in per cent, as a number."""
    if not isinstance(value, str):
        return value
    if (found := PER_CENT.fullmatch(value.strip())) is None:
        rule = "a share is a number or in per cent, 0.2 or 20 %"
    elif 0 <= (share := float(found[1]) / 100) < 1:
        return share
    else:
        rule = "a share of at least 0 % and less than 100 % is needed"
    raise PydanticCustomError("form", "{rule}", {"rule": rule})


Share = Annotated[
    float,
    Field(ge=0, lt=1, allow_inf_nan=False),
    BeforeValidator(_share),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "minimum": 0, "exclusiveMaximum": 1},
                {"type": "string", "pattern": r"^\s*[+-]?[0-9]+(\.[0-9]+)? ?%\s*$"},
            ]
        }
    ),
]


def _bare(value: object) -> object:
    """Refuses a number that is written with its unit."""
    if isinstance(value, str) and UNIT.fullmatch(value.strip()):
        rule = (
            "a number without its unit is needed: lengths and angles are in the units of this file (units:)"
        )
        raise PydanticCustomError("form", "{rule}", {"rule": rule})
    return value


BareLength = Annotated[float, Field(ge=0, allow_inf_nan=False), BeforeValidator(_bare)]


class StartRegionPart(Part):
    """Poses about the start in which the object may lie."""

    position: BareLength = unstated("So far from it, in any direction; 0 if left out.")
    angle: BareLength = unstated("Turned so far to either side, at most 45°; 0 if left out.")


class UncertaintyPart(Part):
    """How well pressure and friction are known."""

    loads: Share = Field(
        default=0.0,
        description="The share by which pressure times table friction may differ at every point, 0 to less than 1,"
        " or as 20 %.",
    )
    friction: Annotated[list[Positive], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="[least, greatest] coefficient between fingertip and object."
    )
    offset: BareLength = unstated(
        "How far the fingers may stand along a side from their place; 0 if left out."
    )
    start: StartRegionPart | None = Field(
        default=None,
        description="{position: 2, angle: 2}: the object may start so far from its place, turned by so much; plans"
        " then end within the goal tolerance from all of it.",
    )


class ObjectPart(Part):
    """A rigid object on the table, in the frame of its drawing."""

    name: Text = Field(default="object", description="Any text; numbers and the like in quotes.")
    outline: OutlineForm = Field(
        description="A list of [x, y] corners, {circle: r}, {file: part.svg}, {file: part.dxf} or "
        "{file: mask.png, pixel: 0.4}."
    )
    support: SupportForm = Field(
        default="uniform",
        description="Where the object presses on the table: uniform, outline, unknown, "
        "{points: [[x, y, weight], ...]}, {disc: r} or {ring: r}.",
    )
    friction: Annotated[float, Field(ge=0, le=1000, allow_inf_nan=False)] = Field(
        description="The Coulomb coefficient between fingertip and object, 0 or more."
    )
    surface: SurfaceForm | None = Field(
        default=None,
        description="A known limit surface about the centre of friction, in SI: {ellipsoid: 3 × 3 matrix}, "
        "{quartic: 15 coefficients} or {file: surface.json}; it overrides the support's.",
    )
    uncertainty: UncertaintyPart | None = Field(
        default=None,
        description="{loads: 0.2, friction: [0.24, 0.4], offset: 0.5, start: {position: 2, angle: 2}}: two-finger"
        " pushes are proved for all of it.",
    )


class PusherPart(Part):
    """The fingers and how they may move."""

    fingers: Fingers = Field(default=1, description="1 or 2.")
    spacing: NotNegative = unstated("The distance of the centres of two fingertips.")
    tip_radius: NotNegative = unstated("The radius of a fingertip; 2.5 mm if left out.")
    speed: Positive = unstated("The greatest speed of a fingertip; 20 mm/s if left out.")
    acceleration: Positive = unstated("The greatest acceleration; 100 mm/s² if left out.")
    approach: NotNegative = unstated("The distance at which it lands; 2 mm if left out.")
    turns: bool = Field(
        default=True, description="false: the finger keeps its orientation and rolls along the object."
    )
    transit: Literal["lift", "planar"] = Field(default="lift", description="Between pushes: lift or planar.")
    lift: Positive = unstated("The height of a lifted transit; 30 mm if left out.")
    turn_rate: Positive = unstated("The greatest turn rate of the hand; 90°/s if left out.")
    travel_speed: Positive = unstated("The greatest speed of a lifted fingertip; 100 mm/s if left out.")
    travel_acceleration: Positive = unstated("Its greatest acceleration; 500 mm/s² if left out.")


class PushAtPart(Part):
    """A push at the outline point nearest to a given one."""

    name: Text | None = Field(default=None, description='A name of its own; "push 1" and so on if left out.')
    at: Point = Field(description="A point [x, y] of the outline, not a corner.")
    fingers: Fingers | None = Field(default=None, description="1 or 2; the pusher's if left out.")
    spacing: NotNegative | None = Field(default=None, description="The pusher's if left out.")


class PushEdgePart(Part):
    """A push at a place on an edge."""

    name: Text | None = Field(default=None, description='A name of its own; "push 1" and so on if left out.')
    edge: Annotated[int, Field(ge=0)] = Field(
        description="The number of the edge; edge 0 runs from the first corner to the second."
    )
    along: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = Field(
        description="The place on the edge, between 0 (its first corner) and 1 (its second)."
    )
    fingers: Fingers | None = Field(default=None, description="1 or 2; the pusher's if left out.")
    spacing: NotNegative | None = Field(default=None, description="The pusher's if left out.")


PushForm = Annotated[
    Annotated[PushAtPart, Tag("<at>")] | Annotated[PushEdgePart, Tag("<edge>")],
    *forms("a push", (("at",), ("edge", "along")), others=("name", "fingers", "spacing")),
]
PushesForm = Annotated[
    Annotated[Literal["auto"], Tag("<word>")] | Annotated[list[PushForm], Tag("<list>"), Field(min_length=1)],
    *forms("the value of pushes", (), word=True, listed="list"),
]


class WorkspacePart(Part):
    """Where object and pusher must stay."""

    bounds: Annotated[list[Number], Field(min_length=4, max_length=4)] | None = Field(
        default=None, description="[xmin, ymin, xmax, ymax]."
    )
    obstacles: list[ObstacleForm] = Field(
        default=[],
        description="A list of obstacles, each a list of [x, y] corners or {circle: r, centre: [x, y]}.",
    )


class MarginPart(Part):
    """What is kept free of the limits."""

    friction: Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)] = Field(
        default=0.2, description="The part of the friction that is kept in reserve, from 0 to less than 1."
    )
    clearance: NotNegative = unstated("The distance kept from obstacles and bounds; 0 if left out.")


class PlanningPart(Part):
    """How to plan."""

    model: Literal["exact", "ellipsoid", "local", "quartic"] = Field(
        default="exact", description="exact, ellipsoid, local or quartic."
    )
    two_finger: Literal["cone", "middle"] = Field(
        default="cone",
        description="cone (composite cone of both fingers) or middle (one contact between them).",
    )
    proof: Literal["set", "nominal"] = Field(
        default="set",
        description="Of an object with an uncertainty: pushes hold on every table of the set, or on the nominal one.",
    )
    slides: Literal["auto", "join", "never"] = Field(
        default="auto",
        description="Pushes of one finger that slide: auto (where no push can steer), join (where cheaper) or never.",
    )
    cost: Literal["flat", "pusher", "time"] = Field(default="flat", description="flat, pusher or time.")
    switch_cost: NotNegative | None = Field(
        default=None,
        description="The cost of a change of contact, in the unit of the cost; 30 mm for flat, else 0.",
    )
    margin: MarginPart = Field(default_factory=MarginPart, description="{friction: 0.2, clearance: 0}.")
    goal_tolerance: Annotated[list[Positive], Field(min_length=3, max_length=3)] = Field(
        default_factory=list,
        description="[x, y, angle]; 0.5 mm, 0.5 mm and 0.5° if left out; plans use what is wider.",
    )
    robust: bool = Field(
        default=False, description="true: minimise the cost after small errors of the switch poses."
    )
    seed: Annotated[int, Field(ge=0)] = Field(
        default=0, description="Of the random search; a whole number, 0 or more."
    )
    iterations: Annotated[int, Field(ge=1)] = Field(default=10000, description="A whole number, 1 or more.")
    time_limit: Positive = Field(default=5.0, description="Seconds.")


class LogsPart(Part):
    """How recordings of this object are written, which `flatpush identify`, `calibrate` and `replay` read."""

    columns: dict[Text, Text] = Field(
        default_factory=dict,
        description="The recordings' own names of columns, {x: obj_x, theta: yaw}; a unit may follow in brackets.",
    )
    length: Literal["m", "cm", "mm"] = Field(
        default="m", description="Of columns without a unit: m, cm or mm."
    )
    angle: Literal["rad", "deg"] = Field(default="rad", description="Of columns without a unit: rad or deg.")


class SceneModel(Part):
    """A scene: what is pushed, by what, from where to where."""

    flatpush: Literal["scene/1"] = Field(description="The version of this document: scene/1.")
    units: UnitsPart = Field(
        default_factory=UnitsPart, description="{length: mm, angle: deg}; m and rad if left out."
    )
    object: ObjectPart = Field(description="{outline: ..., friction: ...}.")
    pusher: PusherPart = Field(
        default_factory=PusherPart, description="{fingers: 2, spacing: 18, tip_radius: 2.5}."
    )
    pushes: PushesForm = Field(
        default="auto", description="auto, or a list of {name: ..., at: [x, y]} or {edge: 0, along: 0.5}."
    )
    start: Pose = Field(description="The object's pose at the start, [x, y, angle].")
    goal: Goal = Field(description="The object's pose to reach, [x, y, angle]; [x, y, free] for any angle.")
    workspace: WorkspacePart = Field(
        default_factory=WorkspacePart,
        description="{bounds: [xmin, ymin, xmax, ymax], obstacles: [...]}.",
    )
    planning: PlanningPart = Field(default_factory=PlanningPart, description="How to plan.")
    logs: LogsPart | None = Field(
        default=None, description="{columns: {x: obj_x, theta: yaw}, length: mm, angle: deg}."
    )
