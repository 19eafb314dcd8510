"""The mechanics of one push, as [Zhou2017] Figs. 1 and 2 and `flatpush describe --figure` show them."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..contact import PointContact
from ..errors import InputError
from ..friction.surface import LimitSurface
from ..geometry import rotate, shift_twist
from ..geometry.pose import Array
from ..planning import PushDescription
from ..planning.options import push_option
from ..problem import Arc, Scene
from ..problem.mechanics import contacts_of, surface_at, takes_cone, virtual_contact
from ..view import palette, words
from ..view.push_figure import REGION, caption, sense
from ..view.push_sketch import PushSketch
from ..view.sketches import sketches
from ..view.table import MM

FAR = 40.0  # how long a ray of turning centres is, by the distance of the contact from the centre of friction
RINGS, SPOKES = 9, 24  # of the picture of a limit surface
CURVE = 13  # points of the edge of a friction cone on it


def mechanics(scene: Scene, name: str, arcs: Sequence[Arc] = ()) -> dict[str, object]:
    """Cones, turning centres and their rays or, of two fingers with their composite cone, the regions of their stable
    centres; the limit surface with the wrenches of the cone; and what the contact does along some arcs.

    Args:
        scene: with its pushes listed.
        name: of the push.
        arcs: of that push in a plan.

    Returns:
        plain values in the object's frame O [mm]; directions are unit vectors.

    Raises:
        InputError: for a push that the scene does not have, or whose fingers do not fit.
    """
    push = next((push for push in scene.pushes if not isinstance(push, str) and push.name == name), None)
    if push is None:
        raise InputError("the scene has no push of this name", key="push", value=name)
    described = PushDescription(push, push_option(scene, push, margin=0.0), {}, float("nan"))
    found = sketches(scene, [described])
    if not found:
        raise InputError(described.option.refusal, key=name)
    sketch = found[0]
    size, areas = REGION * scene.object.outline.size, list[Mapping[str, object]]()
    for sign, colour in ((1, palette.COUNTER_CLOCKWISE), (-1, palette.CLOCKWISE)):
        for region, opacity in ((sketch.region, 0.16), (sketch.any_pressure, 0.3)):
            if region is not None:
                corners = region.polygon(sign, (-size, -size, size, size))
                if len(corners) > 2:
                    areas.append({"corners": _mm(corners + sketch.cof), "colour": colour, "opacity": opacity})
    centres = [
        {"at": _mm(centre), "sign": sign}
        for centre, sign in ((sketch.left_centre, 1), (sketch.right_centre, -1))
        if np.all(np.isfinite(centre))
    ]
    return {
        "kind": "mechanics",
        "push": name,
        "caption": caption(sketch) if sketch.steers else sketch.refusal,
        "contact": _mm(sketch.contact),
        "cones": [
            _cone(words.FRICTION_CONE, palette.FORCE, sketch.force_left, sketch.force_right),
            _cone(words.MOTION_CONE, palette.MOTION, sketch.motion_left, sketch.motion_right),
        ],
        "centres": centres,
        "flat": _mm(sketch.flat_point) if sketch.steers else None,
        "areas": areas,
        "rays": _rays(sketch),
        **_surface(scene, described, sketch, arcs),
    }


def _rays(sketch: PushSketch) -> list[Mapping[str, object]]:
    """The centres that one contact keeps, from its tightest turns outwards ([Zhou2017] Fig. 2)."""
    if sketch.region is not None or not sketch.steers:
        return []
    turns = (
        (1, sketch.left_centre, palette.COUNTER_CLOCKWISE),
        (-1, sketch.right_centre, palette.CLOCKWISE),
    )
    if len(sketch.centres):
        senses = sense(sketch)
        return [
            {"points": _mm(sketch.centres[senses == sign]), "colour": colour} for sign, _, colour in turns
        ]
    along = sketch.left_centre - sketch.right_centre
    away = FAR * np.linalg.norm(sketch.contact - sketch.cof) * along / np.linalg.norm(along)
    return [
        {"points": _mm(np.stack([centre, centre + sign * away])), "colour": colour}
        for sign, centre, colour in turns
    ]


def _surface(
    scene: Scene, described: PushDescription, sketch: PushSketch, arcs: Sequence[Arc]
) -> dict[str, object]:
    """The limit surface, forces as shares of the greatest without a moment, moments of the greatest without a force.

    Its mesh is made of the wrenches of twists, ring by ring; the edge of the friction cone goes around on it; and to
    each arc belong the wrench, the velocity u of the (virtual) contact, a direction in O, and with one finger the
    direction of its force.
    """
    placement = described.option.placement
    assert placement is not None
    contact = virtual_contact(scene, placement)
    surface = surface_at(scene, contact)
    scale = np.abs(np.diag(surface.wrench(np.eye(3))))
    two = takes_cone(scene, len(placement.tips))
    edge = _cone_on(surface, contacts_of(scene, placement) if two else (contact,))
    angles, turns = np.linspace(-np.pi / 2, np.pi / 2, RINGS), np.linspace(0, 2 * np.pi, SPOKES + 1)
    B, L = np.meshgrid(angles[1:-1], turns, indexing="ij")
    twists = np.stack(
        [np.cos(B) * np.cos(L), np.cos(B) * np.sin(L), np.sin(B) * scale[0] / scale[2]], axis=-1
    )
    told = []
    for arc in arcs:
        twist = shift_twist(np.asarray(arc.twist, dtype=float), scene.object.cof)
        wrench = surface.wrench(twist)
        x, y = sketch.contact - scene.object.cof
        u = np.array([twist[0] - twist[2] * y, twist[1] + twist[2] * x])
        told.append({
            "wrench": (wrench / scale).round(4).tolist(),
            "u": (u / np.hypot(*u)).round(5).tolist(),
            "force": None if two else (wrench[:2] / np.hypot(*wrench[:2])).round(5).tolist(),
        })  # fmt: skip
    return {
        "mesh": (surface.wrench(twists) / scale).round(3).tolist(),
        "edge": (edge / scale).round(3).tolist(),
        "arcs": told,
    }


def _cone_on(surface: LimitSurface, contacts: Sequence[PointContact]) -> Array:
    """Where the friction cone of one contact, or the composite cone of two, meets the limit surface: a closed line."""
    edges = [[c.wrench(rotate(side * c.half_angle, c.normal)) for side in (1, -1)] for c in contacts]
    corners = edges[0] if len(edges) == 1 else [*edges[0], *reversed(edges[1])]
    share = np.linspace(0, 1, CURVE)[:, None]
    rows = [(1 - share) * a + share * b for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    F = np.concatenate(rows)
    return F / np.asarray(surface.value(F))[:, None] ** (1 / surface.degree)


def _mm(values: Array) -> list[object]:
    return (MM * np.asarray(values, dtype=float)).round(3).tolist()


def _cone(name: str, colour: str, *edges: Array) -> dict[str, object]:
    units = [(np.asarray(v) / np.hypot(*v)).round(5).tolist() for v in edges]
    return {"name": name, "colour": colour, "edges": units}
