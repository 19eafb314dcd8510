"""Reads the outline of a scene from the drawing that it names, and tells what was read."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..geometry import Outline
from ..geometry.pose import Array
from ..problem.frame import far_origin
from . import scene_model as m
from .context import PER_METRE, Context
from .push_reader import open_polygon
from .reading import read_mapping
from .refusals import checked
from .shapes import Choice, DrawnOutline, load_drawing


@dataclass(frozen=True, eq=False)
class OutlineNote:
    """What a scene's outline was made of, where that is not simply what it lists.

    Attributes:
        lines: sentences for people, lengths in the units of the scene.
        drawing: what was drawn; None for an outline of pixels that was listed.
    """

    lines: tuple[str, ...]
    drawing: DrawnOutline | None = None

    def data(self) -> dict[str, object]:
        """The note as plain values, lengths in m and angles in rad."""
        found: dict[str, object] = {"lines": list(self.lines)}
        if (drawn := self.drawing) is not None:
            found |= {
                "file": drawn.source,
                "taken": drawn.taken,
                "corners": len(drawn.outline.vertices),
                "tolerance": drawn.tolerance,
                "unit": drawn.unit,
                "unit_declared": drawn.declared,
                "origin": drawn.origin.tolist(),
                "turn": drawn.turn,
                "left_out": [{"what": part.place, "reason": part.reason} for part in drawn.left_out],
            }
        return found


def read_drawing(ctx: Context, form: m.ShapeFilePart) -> DrawnOutline:
    """The outline of a scene that names a drawing."""
    if isinstance(form.origin, str):
        origin: str | tuple[float, float] = form.origin
    else:
        x, y = ctx.lengths(form.origin).tolist()
        origin = x, y
    if abs(ctx.angle(form.turn)) > 4 * np.pi:
        raise ctx.refuse(
            "an angle is within two turns", "object.outline.turn", hint="Check the units: {angle: deg}."
        )
    choice = Choice(form.layer or "", origin, ctx.angle(form.turn), (form.pixel or 0.0) / ctx.per_metre)
    return load_drawing(ctx.folder / form.file, 1 / ctx.per_metre, choice)


def pixels(ctx: Context, corners: Array) -> tuple[Array, float] | None:
    """A listed outline of pixels without its steps, and the tolerance [m]; None if it is another outline.

    In a plan, which holds what was read, and where pushes stand on its edges it stays as it is.
    """
    pushes = ctx.raw.get("pushes", "auto")
    if ctx.prefix or (isinstance(pushes, list) and any("edge" in push for push in pushes)):
        return None
    from .bitmap import without_steps

    return without_steps(corners)


def outline_note(path: str | os.PathLike[str]) -> OutlineNote | None:
    """What the outline of a scene file was made of; None where it is simply what the scene lists.

    Raises:
        InputError: as load_scene.
    """
    source = os.fspath(path)
    raw = read_mapping(path)
    model = checked(m.SceneModel, raw, source)
    ctx = Context(source, "", raw, PER_METRE[model.units.length], model.units.angle == "deg")
    form = model.object.outline
    lines: list[str] = []
    drawn = None
    with ctx.at("object.outline"):
        if isinstance(form, m.ShapeFilePart):
            drawn = read_drawing(ctx, form)
            outline = drawn.outline
            lines = _told(drawn, ctx)
        elif isinstance(form, list):
            corners = open_polygon(ctx.lengths(form))
            if smooth := pixels(ctx, corners):
                corners = smooth[0]
                within = _length(smooth[1], ctx)
                lines = [f"outline: {len(form)} corners of pixels, made smooth within {within}"]
            outline = Outline.polygon(corners)
        else:
            outline = Outline.circle(form.circle / ctx.per_metre, ctx.lengths(form.centre))
        if (origin := far_origin(outline)) is not None:
            x, y = (origin * ctx.per_metre).tolist()
            lines.append(
                f"the origin of the outline is far away: in plans, poses are those of its centroid,"
                f" ({x:.9g}, {y:.9g}) {ctx.length_unit}"
            )
    return OutlineNote(tuple(lines), drawn) if lines else None


def _told(drawn: DrawnOutline, ctx: Context) -> list[str]:
    unit = "its own" if drawn.declared else "the scene's"
    if drawn.source.lower().endswith((".svg", ".dxf")):
        unit = f"{1000 * drawn.unit:.6g} mm ({unit})"
    else:
        unit = f"{_length(drawn.unit, ctx)} a pixel"
    n = len(drawn.outline.vertices)
    x, y = (drawn.origin * ctx.per_metre).tolist()
    turned = f", turned by {np.rad2deg(drawn.turn):.6g}°" if drawn.turn else ""
    lines = [
        f"outline: {drawn.taken} of {Path(drawn.source).name}: {n} corners within {_length(drawn.tolerance, ctx)}",
        f"unit of the drawing: {unit}",
        f"frame O: origin at ({x:.6g}, {y:.6g}) {ctx.length_unit} of the drawing, y up{turned}",
    ]
    reasons: dict[str, list[str]] = {}
    for part in drawn.left_out:
        reasons.setdefault(part.reason, []).append(part.place)
    for reason, places in reasons.items():
        shown = list(dict.fromkeys(places))
        more = f" and {len(shown) - 3} more" if len(shown) > 3 else ""
        lines.append(f"left out, {reason}: {'; '.join(shown[:3])}{more}")
    return lines


def _length(value: float, ctx: Context) -> str:
    return f"{value * ctx.per_metre:.3g} {ctx.length_unit}"
