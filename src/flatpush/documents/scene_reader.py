"""Builds a Scene in SI from a scene document."""

from collections.abc import Mapping
from itertools import islice
from typing import Any, Literal

import numpy as np

from ..errors import InputError
from ..geometry import Outline
from ..geometry.pose import Array
from ..problem import Object, Planning, Pusher, Scene, Workspace
from ..problem.frame import moved_inside
from ..problem.scene import StartRegion, Uncertainty
from . import scene_model as m
from .context import PER_METRE, Context
from .outline_reader import pixels, read_drawing
from .push_reader import open_polygon, read_pushes
from .reading import MOST_ENTRIES, join, plain
from .refusals import checked, nearest

# Keys of the pusher that are lengths, or lengths over time.
LENGTHS = (
    *("spacing", "tip_radius", "speed", "acceleration", "approach", "lift"),
    *("travel_speed", "travel_acceleration"),
)
# Of an outline, and of all obstacles together: with so many describe takes 20 s, with 95,000 minutes.
MOST_CORNERS = 20_000
# A pose whose angle is more than two turns was written in degrees.
TWO_TURNS = {"rad": 4 * np.pi, "deg": 720.0}


def parse_scene(
    document: Mapping[str, object], source: str = "", key: str = "", *, unknown: bool = False
) -> Scene:
    """The scene in a mapping that is laid out like a scene file.

    Lists may be tuples or arrays. Paths inside it are relative to the folder of the source.

    Args:
        document: the mapping.
        source: the file it came from, for errors and for relative paths.
        key: where in that file it stands, as "scene" in a plan.
        unknown: as of load_scene.

    Raises:
        InputError: as load_scene.

    >>> scene = parse_scene({
    ...     "flatpush": "scene/1", "units": {"length": "mm", "angle": "deg"},
    ...     "object": {"outline": {"circle": 40}, "friction": 0.3},
    ...     "start": [60, 20, 180], "goal": [0, 0, 0]})
    >>> scene.object.outline.radius, scene.start.tolist()
    (0.04, [0.06, 0.02, 3.141592653589793])
    """
    _check_lengths(document, source, key)
    _check_corners(document, source, key)
    raw = _checked_version(plain(document, source, key), source, key)
    model = checked(m.SceneModel, raw, source, key)
    if model.object.support == "unknown" and not unknown:
        raise InputError(
            "nothing is known yet of where this object presses on the table",
            source=source,
            key=join(key, "object.support"),
            value="unknown",
            hint="Film some pushes and run flatpush identify PUSHES --scene SCENE -o fitted.yaml, or let it learn while"
            " it pushes: flatpush track SCENE --learn.",
        )
    return _scene(Context(source, key, raw, PER_METRE[model.units.length], model.units.angle == "deg"), model)


def parse_ends(document: Mapping[str, object]) -> tuple[Array, Array]:
    """Start and goal of a mapping as parse_scene reads it, X_WO of shape (3,); a free angle of the goal is nan.

    Raises:
        InputError: as parse_scene, but not for what only an outline, a support or places of pushes can be wrong in.
    """
    _check_lengths(document, "", "")
    raw = _checked_version(plain(document, "", ""), "", "")
    model = checked(m.SceneModel, raw, "", "")
    ctx = Context("", "", raw, PER_METRE[model.units.length], model.units.angle == "deg")
    return _pose(ctx, model.start, "start"), _goal(ctx, model.goal)


def _check_lengths(value: object, source: str, key: str) -> None:
    """Refuses lists that no scene has, before each of their entries is looked at."""
    if isinstance(value, list | tuple) and len(value) > MOST_ENTRIES:
        rule = f"a list of a scene has at most {MOST_ENTRIES} entries, not {len(value)}"
        raise InputError(rule, source=source, key=key)
    if isinstance(value, Mapping):
        for name, item in value.items():
            _check_lengths(item, source, join(key, str(name)))


def _check_corners(document: Mapping[str, object], source: str, key: str) -> None:
    """Refuses more corners of the outline, or of all obstacles together, than can be worked with."""

    def entries(*forms: object) -> int:
        return sum(len(form) for form in forms if isinstance(form, list | tuple | np.ndarray))

    thing, world = document.get("object"), document.get("workspace")
    outline = thing.get("outline") if isinstance(thing, Mapping) else None
    obstacles = world.get("obstacles") if isinstance(world, Mapping) else None
    things = obstacles if isinstance(obstacles, list | tuple) else ()
    for name, corners in (("object.outline", entries(outline)), ("workspace.obstacles", entries(*things))):
        _refuse_corners(corners, source, join(key, name))


def _refuse_corners(count: int, source: str, key: str) -> None:
    if count > MOST_CORNERS:
        raise InputError(
            f"there are at most {MOST_CORNERS} corners, not {count}",
            source=source,
            key=key,
            hint="Leave out those that change the outline by less than it is known.",
        )


def _checked_version(raw: object, source: str, key: str) -> dict[str, Any]:
    if not isinstance(raw, dict):
        raise InputError("a scene is a mapping of keys to values", source=source, key=key, value=raw)
    if "flatpush" not in raw:
        # A misspelt key is named as such.
        near = [k for k in islice(raw, 100) if nearest(k, ["flatpush"]).startswith("Did")]
        hint = f"Did you mean 'flatpush' by {near[0]!r}?" if near else "Begin a scene with flatpush: scene/1."
        raise InputError("this key is missing", source=source, key=join(key, "flatpush"), hint=hint)
    version = raw["flatpush"]
    if version != "scene/1":
        hint = "Write flatpush: scene/1."
        if isinstance(version, str) and version.startswith("plan/"):
            hint = "This is a plan; its scene stands under the key scene."
        elif isinstance(version, str) and version.startswith("scene/"):
            hint = "Is there a newer flatpush that reads it?"
        raise InputError(
            "this flatpush reads scene/1", source=source, key=join(key, "flatpush"), value=version, hint=hint
        )
    return raw


def _scene(ctx: Context, model: m.SceneModel) -> Scene:
    obj = _object(ctx, model.object)
    pusher = _pusher(ctx, model.pusher)
    workspace = _workspace(ctx, model.workspace, obj)
    pushes = model.pushes
    scene = Scene(
        object=obj,
        start=_pose(ctx, model.start, "start"),
        goal=_goal(ctx, model.goal),
        pusher=pusher,
        pushes="auto" if isinstance(pushes, str) else read_pushes(ctx, pushes, obj.outline, pusher),
        workspace=workspace,
        planning=_planning(ctx, model.planning),
    )
    return moved_inside(scene)


def _object(ctx: Context, part: m.ObjectPart) -> Object:
    from .support_form import read_support
    from .surface_file import read_surface

    with ctx.at("object.outline"):
        outline = _outline(ctx, part.outline)
    with ctx.at("object.support"):
        support = read_support(part.support, outline, ctx.per_metre)
    surface = None
    if part.surface is not None:
        with ctx.at("object.surface"):
            surface = read_surface(part.surface, ctx.folder)
    with ctx.at("object"):
        return Object(
            outline, support, part.friction, surface, part.name, _uncertainty(ctx, part.uncertainty)
        )


def _uncertainty(ctx: Context, part: m.UncertaintyPart | None) -> Uncertainty | None:
    if part is None:
        return None
    if not part.model_fields_set:
        raise ctx.refuse(
            "an uncertainty states loads, friction, offset or start",
            "object.uncertainty",
            hint="Without any, leave it out.",
        )
    low_high = None if part.friction is None else (part.friction[0], part.friction[1])
    offset = part.offset / ctx.per_metre if "offset" in part.model_fields_set else 0.0
    return Uncertainty(part.loads, low_high, offset, None if part.start is None else _region(ctx, part.start))


def _region(ctx: Context, part: m.StartRegionPart) -> StartRegion:
    if not part.model_fields_set:
        raise ctx.refuse(
            "a start region states position or angle",
            "object.uncertainty.start",
            hint="Write {position: 2, angle: 2}, or leave it out.",
        )
    position = part.position / ctx.per_metre if "position" in part.model_fields_set else 0.0
    angle = ctx.angle(part.angle) if "angle" in part.model_fields_set else 0.0
    return StartRegion(position, angle)


def _outline(ctx: Context, form: Any) -> Outline:
    if isinstance(form, m.CirclePart):
        return Outline.circle(form.circle / ctx.per_metre, ctx.lengths(form.centre))
    if isinstance(form, m.ShapeFilePart):
        drawn = read_drawing(ctx, form).outline
        _refuse_corners(0 if drawn.is_circle else len(drawn.vertices), "", "")
        return drawn
    corners = open_polygon(ctx.lengths(form))
    return (
        Outline.polygon(corners) if (smooth := pixels(ctx, corners)) is None else Outline.polygon(smooth[0])
    )


def _pusher(ctx: Context, part: m.PusherPart) -> Pusher:
    given = {key: getattr(part, key) for key in part.model_fields_set}
    for key in given:
        if key == "turn_rate":
            given[key] = ctx.angle(given[key])
        elif key in LENGTHS:
            given[key] = given[key] / ctx.per_metre
    with ctx.at("pusher"):
        return Pusher(**given)


def _workspace(ctx: Context, part: m.WorkspacePart, obj: Object) -> Workspace:
    obstacles = []
    for i, form in enumerate(part.obstacles):
        with ctx.at(join("workspace.obstacles", i)):
            if isinstance(form, m.RoundObstaclePart):
                obstacles.append(Outline.circle(form.circle / ctx.per_metre, ctx.lengths(form.centre)))
            else:
                obstacles.append(Outline.polygon(open_polygon(ctx.lengths(form))))
    if part.bounds is None:
        return Workspace(None, tuple(obstacles))
    xmin, ymin, xmax, ymax = ctx.lengths(part.bounds).tolist()
    if not (xmin < xmax and ymin < ymax):
        raise ctx.refuse(
            "the bounds enclose an area",
            "workspace.bounds",
            hint="Their order is [xmin, ymin, xmax, ymax].",
        )
    if obj.outline.size > np.hypot(xmax - xmin, ymax - ymin):
        size = obj.outline.size * ctx.per_metre
        raise ctx.refuse(
            f"the object, {size:.4g} {ctx.length_unit} long, is larger than the workspace",
            "workspace.bounds",
            hint=f"Check the units: lengths in this file are in {ctx.length_unit}.",
        )
    return Workspace((xmin, ymin, xmax, ymax), tuple(obstacles))


def _planning(ctx: Context, part: m.PlanningPart) -> Planning:
    given = {key: getattr(part, key) for key in part.model_fields_set}
    margin = given.pop("margin", None)
    if margin is not None and "friction" in margin.model_fields_set:
        given["friction_margin"] = margin.friction
    if margin is not None and "clearance" in margin.model_fields_set:
        given["clearance"] = margin.clearance / ctx.per_metre
    if given.get("switch_cost") is not None and part.cost != "time":
        given["switch_cost"] = given["switch_cost"] / ctx.per_metre
    if "goal_tolerance" in given:
        x, y, angle = part.goal_tolerance
        if ctx.angle(angle) > np.pi:
            raise ctx.refuse(
                "an angle tolerance is at most half a turn", "planning.goal_tolerance[2]", hint=_UNIT
            )
        given["goal_tolerance"] = (x / ctx.per_metre, y / ctx.per_metre, ctx.angle(angle))
    if given.get("switch_cost") is None:
        given["switch_cost"] = Planning(cost=part.cost).switching
    with ctx.at("planning"):
        return Planning(**given)


def _goal(ctx: Context, values: list[float | Literal["free"]]) -> Array:
    angle = values[2]
    place = [x for x in values[:2] if not isinstance(x, str)]
    if len(place) < 2:
        raise ctx.refuse("only the angle of a goal can be free", "goal", hint="Write [x, y, free].")
    pose = _pose(ctx, [*place, 0.0 if isinstance(angle, str) else angle], "goal")
    return pose if not isinstance(angle, str) else np.array([*pose[:2], np.nan])


def _pose(ctx: Context, values: list[float], key: str) -> Array:
    x, y, angle = values
    if abs(angle) > TWO_TURNS["deg" if ctx.degrees else "rad"]:
        rule = f"an angle of a pose is within two turns ({'720°' if ctx.degrees else '4π rad'})"
        raise ctx.refuse(rule, f"{key}[2]", hint=_TURNS if ctx.degrees else _DEGREES)
    return np.array([x / ctx.per_metre, y / ctx.per_metre, ctx.angle(angle)])


_DEGREES = "It looks like degrees: declare units: {angle: deg}."
_UNIT = "Check the units: {angle: deg} or {angle: rad}."
_TURNS = "Full turns change nothing: leave them out."
