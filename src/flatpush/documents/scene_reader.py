"""Builds a Scene in SI from a scene document."""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry import Outline, OutlinePoint
from ..geometry.pose import Array
from ..problem import Object, Planning, Push, Pusher, Scene, Workspace
from . import scene_model as m
from .reading import join, plain, read_mapping
from .refusals import checked, description, nearest, value_at

PER_METRE = {"m": 1.0, "cm": 100.0, "mm": 1000.0}
# A pose whose angle is more than two turns was written in degrees; a push off the outline by more than this
# part of the size was drawn for another outline.
TWO_TURNS = {"rad": 4 * np.pi, "deg": 720.0}
OFF_OUTLINE = 0.01


def load_scene(path: str | os.PathLike[str], changes: Mapping[str, Any] | None = None) -> Scene:
    """The scene in a YAML or JSON file, in SI.

    Args:
        path: of the file.
        changes: keys of the document that take the place of the file's, in the file's units, as
            {"start": [60, 20, 135], "planning": {"seed": 3}}; mappings replace only the keys that they hold.

    Raises:
        InputError: for anything wrong with the file; it names the file, key, value, rule and a hint.
        MissingExtra: if the outline is a drawing and the extra "shapes" is not installed.
    """
    return parse_scene(_merged(read_mapping(path), changes or {}), os.fspath(path))


def parse_scene(document: Mapping[str, Any], source: str = "", key: str = "") -> Scene:
    """The scene in a mapping that is laid out like a scene file.

    Lists may be tuples or arrays. Paths inside it are relative to the folder of the source.

    Args:
        document: the mapping.
        source: the file it came from, for errors and for relative paths.
        key: where in that file it stands, as "scene" in a plan.

    Raises:
        InputError: as load_scene.

    >>> scene = parse_scene({
    ...     "flatpush": "scene/1", "units": {"length": "mm", "angle": "deg"},
    ...     "object": {"outline": {"circle": 40}, "friction": 0.3},
    ...     "start": [60, 20, 180], "goal": [0, 0, 0]})
    >>> scene.object.outline.radius, scene.start.tolist()
    (0.04, [0.06, 0.02, 3.141592653589793])
    """
    raw = plain(document, source, key)
    _check_version(raw, source, key)
    model = checked(m.SceneModel, raw, source, key)
    reader = _Reader(source, key, raw, PER_METRE[model.units.length], model.units.angle == "deg")
    return reader.scene(model)


def _merged(document: Any, changes: Mapping[str, Any]) -> Any:
    result = dict(document)
    for key, value in changes.items():
        old = result.get(key)
        result[key] = _merged(old, value) if isinstance(old, dict) and isinstance(value, Mapping) else value
    return result


def _check_version(raw: Any, source: str, key: str) -> None:
    if not isinstance(raw, dict):
        raise InputError("a scene is a mapping of keys to values", source=source, key=key, value=raw)
    if "flatpush" not in raw:
        # A misspelt key is named as such.
        near = [k for k in raw if nearest(k, ["flatpush"]).startswith("Did")]
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


@dataclass(frozen=True)
class _Reader:
    """Turns the parts of a document into SI. Keys are relative to the scene."""

    source: str
    prefix: str
    raw: dict[str, Any]
    per_metre: float
    degrees: bool

    def scene(self, model: m.SceneModel) -> Scene:
        obj = self.object(model.object)
        pusher = self.pusher(model.pusher)
        workspace = self.workspace(model.workspace, obj)
        pushes = model.pushes
        return Scene(
            object=obj,
            start=self.pose(model.start, "start"),
            goal=self.pose(model.goal, "goal"),
            pusher=pusher,
            pushes="auto" if isinstance(pushes, str) else self.pushes(pushes, obj.outline, pusher),
            workspace=workspace,
            planning=self.planning(model.planning),
        )

    # --- the parts ----------------------------------------------------------------------------------------

    def object(self, part: m.ObjectPart) -> Object:
        from .mechanics import read_support, read_surface

        with self.at("object.outline"):
            outline = self.outline(part.outline)
        with self.at("object.support"):
            support = read_support(part.support, outline, self.per_metre)
        surface = None
        if part.surface is not None:
            with self.at("object.surface"):
                surface = read_surface(part.surface, self.folder)
        with self.at("object"):
            return Object(outline, support, part.friction, surface, part.name)

    def outline(self, form: Any) -> Outline:
        if isinstance(form, m.CirclePart):
            return Outline.circle(form.circle / self.per_metre, self.lengths(form.centre))
        if isinstance(form, m.ShapeFilePart):
            from .shapes import load_outline

            return load_outline(self.folder / form.file, 1 / self.per_metre)
        return Outline.polygon(_open(self.lengths(form)))

    def pusher(self, part: m.PusherPart) -> Pusher:
        given = {key: getattr(part, key) for key in part.model_fields_set}
        for key in ("spacing", "tip_radius", "speed", "acceleration", "approach", "lift"):
            if key in given:
                given[key] = given[key] / self.per_metre
        with self.at("pusher"):
            return Pusher(**given)

    def pushes(self, parts: list[Any], outline: Outline, pusher: Pusher) -> tuple[Push, ...]:
        result: list[Push] = []
        for i, part in enumerate(parts):
            key = join("pushes", i)
            name = f"push {i + 1}" if part.name is None else part.name
            if name in [push.name for push in result]:
                hint = "Give each push a name of its own."
                raise self.refuse("two pushes have this name", join(key, "name"), value=name, hint=hint)
            point = self.push_at(part.at, outline, key) if isinstance(part, m.PushAtPart) else None
            if point is None:
                point = self.push_on_edge(part.edge, part.along, outline, key)
            fingers = pusher.fingers if part.fingers is None else part.fingers
            spacing = pusher.spacing if part.spacing is None else part.spacing / self.per_metre
            if fingers == 2:
                self.check_two_fingers(spacing, pusher, key)
            result.append(Push(name, point, fingers, spacing if fingers == 2 else 0.0))
        return tuple(result)

    def push_at(self, at: list[float], outline: Outline, key: str) -> OutlinePoint:
        place = self.lengths(at)
        found = outline.nearest(place)
        if abs(found.distance) > OFF_OUTLINE * outline.size:
            off, near = abs(found.distance) * self.per_metre, (found.point * self.per_metre).tolist()
            raise self.refuse(
                f"the point is {off:.4g} off the outline, more than 1 % of the object's size",
                f"{key}.at",
                hint=f"The nearest point is [{near[0]:.6g}, {near[1]:.6g}].",
            )
        if found.corner:
            raise self.refuse("a push is not exactly at a corner", f"{key}.at", hint=_NO_NORMAL)
        return settled(outline, found.point)

    def push_on_edge(self, edge: int, along: float, outline: Outline, key: str) -> OutlinePoint:
        corners = self.raw["object"]["outline"]
        if isinstance(corners, list):
            edge = self.kept_edge(np.array(corners, dtype=float), edge, key)
        last = 0 if outline.is_circle else len(outline.vertices) - 1
        if edge > last:
            hint = "A circle has edge 0 only; along is its angle / 2π." if outline.is_circle else ""
            hint = hint or "Edge 0 runs from the first corner to the second, the last one back to the first."
            raise self.refuse(f"edges count from 0 to {last}", f"{key}.edge", hint=hint)
        found = outline.at(edge, along)
        if found.corner:
            raise self.refuse("a push is not exactly at a corner", f"{key}.along", hint=_NO_NORMAL)
        return settled(outline, found.point)

    def kept_edge(self, corners: Array, edge: int, key: str) -> int:
        """The number of an edge, which counts in the corners as written, among the corners that differ."""
        corners = _open(corners)
        step = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        distinct = step > 1e-9 * np.max(np.ptp(corners, axis=0))
        if edge >= len(corners):
            last = len(corners) - 1
            hint = "Edge 0 runs from the first corner to the second, the last one back to the first."
            raise self.refuse(f"edges count from 0 to {last}", f"{key}.edge", hint=hint)
        if not distinct[edge]:
            raise self.refuse(
                "this edge has no length", f"{key}.edge", hint="Its corners are equal; choose another edge."
            )
        return int(np.sum(distinct[:edge]))

    def check_two_fingers(self, spacing: float, pusher: Pusher, key: str) -> None:
        if spacing <= 0:
            hint = "Give spacing to this push or to the pusher."
            value = spacing * self.per_metre
            raise self.refuse("two fingers need a positive spacing", f"{key}.spacing", value=value, hint=hint)
        if spacing < 2 * pusher.tip_radius:
            hint = "The spacing is at least twice the tip radius."
            value = spacing * self.per_metre
            raise self.refuse("the fingers overlap", f"{key}.spacing", value=value, hint=hint)
        if not pusher.turns:
            raise self.refuse(
                "two fingers that cannot turn cannot turn an object",
                f"{key}.fingers",
                value=2,
                hint="Use one finger.",
            )

    def workspace(self, part: m.WorkspacePart, obj: Object) -> Workspace:
        obstacles = []
        for i, corners in enumerate(part.obstacles):
            with self.at(join("workspace.obstacles", i)):
                obstacles.append(Outline.polygon(_open(self.lengths(corners))).vertices)
        if part.bounds is None:
            return Workspace(None, tuple(obstacles))
        xmin, ymin, xmax, ymax = self.lengths(part.bounds).tolist()
        if not (xmin < xmax and ymin < ymax):
            raise self.refuse(
                "the bounds enclose an area",
                "workspace.bounds",
                hint="Their order is [xmin, ymin, xmax, ymax].",
            )
        if obj.outline.size > np.hypot(xmax - xmin, ymax - ymin):
            size = obj.outline.size * self.per_metre
            raise self.refuse(
                f"the object, {size:.4g} {self.length_unit} long, is larger than the workspace",
                "workspace.bounds",
                hint=f"Check the units: lengths in this file are in {self.length_unit}.",
            )
        return Workspace((xmin, ymin, xmax, ymax), tuple(obstacles))

    def planning(self, part: m.PlanningPart) -> Planning:
        given = {key: getattr(part, key) for key in part.model_fields_set}
        if given.get("two_finger") == "cone":
            raise self.refuse(
                "the true composite cone of two fingers is not available yet",
                "planning.two_finger",
                hint="Use two_finger: middle.",
            )
        margin = given.pop("margin", None)
        if margin is not None and "friction" in margin.model_fields_set:
            given["friction_margin"] = margin.friction
        if margin is not None and "clearance" in margin.model_fields_set:
            given["clearance"] = margin.clearance / self.per_metre
        if given.get("switch_cost") is not None and part.cost != "time":
            given["switch_cost"] = given["switch_cost"] / self.per_metre
        if "goal_tolerance" in given:
            x, y, angle = part.goal_tolerance
            if self.angle(angle) > np.pi:
                raise self.refuse(
                    "an angle tolerance is at most half a turn", "planning.goal_tolerance[2]", hint=_DEGREES
                )
            given["goal_tolerance"] = (x / self.per_metre, y / self.per_metre, self.angle(angle))
        if given.get("switch_cost") is None:
            given["switch_cost"] = Planning(cost=part.cost).switching
        with self.at("planning"):
            return Planning(**given)

    # --- units --------------------------------------------------------------------------------------------

    @property
    def folder(self) -> Path:
        return Path(self.source).parent if self.source else Path()

    @property
    def length_unit(self) -> str:
        return next(unit for unit, per_metre in PER_METRE.items() if per_metre == self.per_metre)

    def lengths(self, values: Any) -> Array:
        # A quotient, so that 19.667 mm is the float nearest to 0.019667 m.
        return np.array(values, dtype=float) / self.per_metre

    def angle(self, value: float) -> float:
        return float(np.deg2rad(value)) if self.degrees else value

    def pose(self, values: list[float], key: str) -> Array:
        x, y, angle = values
        if abs(angle) > TWO_TURNS["deg" if self.degrees else "rad"]:
            rule = f"an angle of a pose is within two turns ({'720°' if self.degrees else '4π rad'})"
            raise self.refuse(rule, f"{key}[2]", hint=_TURNS if self.degrees else _DEGREES)
        return np.array([x / self.per_metre, y / self.per_metre, self.angle(angle)])

    # --- refusals -----------------------------------------------------------------------------------------

    def refuse(self, rule: str, key: str, *, hint: str, value: Any = None) -> InputError:
        shown = self.value(key) if value is None else value
        return InputError(rule, source=self.source, key=join(self.prefix, key), value=shown, hint=hint)

    def value(self, key: str) -> Any:
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
            shown = self.value(where)
            raise InputError(
                rule,
                source=self.source,
                key=join(self.prefix, where),
                value=error.value if shown is None else shown,
                hint=error.hint or description(m.SceneModel, where),
            ) from None


def settled(outline: Outline, point: Array) -> OutlinePoint:
    """The outline point with exactly these coordinates: a document that holds them reads back to the same
    push."""
    found = outline.nearest(point)
    return OutlinePoint(point, found.normal, found.edge, found.along)


def _open(corners: Array) -> Array:
    """The corners without those at the end that repeat the first, so that edge 0 stays the first one
    written."""
    while len(corners) > 1 and np.array_equal(corners[-1], corners[0]):
        corners = corners[:-1]
    return corners


_NO_NORMAL = "A corner has no normal; move the push along an edge."
_DEGREES = "It looks like degrees: declare units: {angle: deg}."
_TURNS = "Full turns change nothing: leave them out."
_RENAMED = {
    "planning.friction_margin": "planning.margin.friction",
    "planning.clearance": "planning.margin.clearance",
}
