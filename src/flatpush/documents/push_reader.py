"""Reads the places to push at."""

import numpy as np

from ..geometry import Outline, OutlinePoint
from ..geometry.pose import Array
from ..problem import Push, Pusher
from . import scene_model as m
from .context import Context
from .reading import join

# A push further off the outline than this part of the size was drawn for another outline.
OFF_OUTLINE = 0.01


def read_pushes(
    ctx: Context, parts: list[m.PushAtPart | m.PushEdgePart], outline: Outline, pusher: Pusher
) -> tuple[Push, ...]:
    """The pushes of a scene, with the pusher's fingers where they have none of their own."""
    result: list[Push] = []
    for i, part in enumerate(parts):
        key = join("pushes", i)
        name = f"push {i + 1}" if part.name is None else part.name
        if name in [push.name for push in result]:
            hint = "Give each push a name of its own."
            raise ctx.refuse("two pushes have this name", join(key, "name"), value=name, hint=hint)
        if isinstance(part, m.PushAtPart):
            point = _push_at(ctx, part.at, outline, key)
        else:
            point = _push_on_edge(ctx, part.edge, part.along, outline, key)
        fingers = pusher.fingers if part.fingers is None else part.fingers
        spacing = pusher.spacing if part.spacing is None else part.spacing / ctx.per_metre
        if fingers == 2:
            _check_two_fingers(ctx, spacing, pusher, key)
        result.append(Push(name, point, fingers, spacing if fingers == 2 else 0.0))
    return tuple(result)


def _push_at(ctx: Context, at: list[float], outline: Outline, key: str) -> OutlinePoint:
    place = ctx.lengths(at)
    found = outline.nearest(place)
    if abs(found.distance) > OFF_OUTLINE * outline.size:
        off, near = abs(found.distance) * ctx.per_metre, (found.point * ctx.per_metre).tolist()
        raise ctx.refuse(
            f"the point is {off:.4g} off the outline, more than 1 % of the object's size",
            f"{key}.at",
            hint=f"The nearest point is [{near[0]:.6g}, {near[1]:.6g}].",
        )
    if found.corner:
        raise ctx.refuse("a push is not exactly at a corner", f"{key}.at", hint=_NO_NORMAL)
    # A point that lies on the outline but for rounding is kept as it is written.
    on_it = abs(found.distance) <= 1e-12 * outline.size
    return settled(outline, place if on_it else found.point)


def _push_on_edge(ctx: Context, edge: int, along: float, outline: Outline, key: str) -> OutlinePoint:
    corners = ctx.raw["object"]["outline"]
    if isinstance(corners, list):
        edge = _kept_edge(ctx, np.array(corners, dtype=float), edge, key)
    last = 0 if outline.is_circle else len(outline.vertices) - 1
    if edge > last:
        hint = "A circle has edge 0 only; along is its angle / 2π." if outline.is_circle else ""
        hint = hint or "Edge 0 runs from the first corner to the second, the last one back to the first."
        raise ctx.refuse(f"edges count from 0 to {last}", f"{key}.edge", hint=hint)
    found = outline.at(edge, along)
    if found.corner:
        raise ctx.refuse("a push is not exactly at a corner", f"{key}.along", hint=_NO_NORMAL)
    return settled(outline, found.point)


def _kept_edge(ctx: Context, corners: Array, edge: int, key: str) -> int:
    """The number of an edge, which counts in the corners as written, among the corners that differ."""
    corners = open_polygon(corners)
    step = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    distinct = step > 1e-9 * np.max(np.ptp(corners, axis=0))
    if edge >= len(corners):
        last = len(corners) - 1
        hint = "Edge 0 runs from the first corner to the second, the last one back to the first."
        raise ctx.refuse(f"edges count from 0 to {last}", f"{key}.edge", hint=hint)
    if not distinct[edge]:
        raise ctx.refuse(
            "this edge has no length", f"{key}.edge", hint="Its corners are equal; choose another edge."
        )
    return int(np.sum(distinct[:edge]))


def _check_two_fingers(ctx: Context, spacing: float, pusher: Pusher, key: str) -> None:
    if spacing <= 0:
        hint = "Give spacing to this push or to the pusher."
        value = spacing * ctx.per_metre
        raise ctx.refuse("two fingers need a positive spacing", f"{key}.spacing", value=value, hint=hint)
    if spacing < 2 * pusher.tip_radius:
        hint = "The spacing is at least twice the tip radius."
        value = spacing * ctx.per_metre
        raise ctx.refuse("the fingers overlap", f"{key}.spacing", value=value, hint=hint)
    if not pusher.turns:
        raise ctx.refuse(
            "two fingers that cannot turn cannot turn an object",
            f"{key}.fingers",
            value=2,
            hint="Use one finger.",
        )


def settled(outline: Outline, point: Array) -> OutlinePoint:
    """The outline point with exactly these coordinates: a document that holds them reads back to the same
    push."""
    found = outline.nearest(point)
    return OutlinePoint(point, found.normal, found.edge, found.along)


def open_polygon(corners: Array) -> Array:
    """The corners without those at the end that repeat the first, so that edge 0 stays the first one
    written."""
    while len(corners) > 1 and np.array_equal(corners[-1], corners[0]):
        corners = corners[:-1]
    return corners


_NO_NORMAL = "A corner has no normal; move the push along an edge."
