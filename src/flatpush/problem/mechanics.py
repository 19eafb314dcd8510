"""From a push of a scene to its mechanics: fingertips, contacts and the limit surface of a model, all about the COF."""

from functools import lru_cache

import numpy as np

from ..contact import Placement, PointContact, cone_twists, place_fingers
from ..contact.landing import Landing, Side, landing
from ..contact.proved_twists import Bounds, proved_twists
from ..contact.table_set import TableSet
from ..errors import FlatpushError, InputError
from ..friction import Ellipsoid, Exact, LimitSurface, Quartic, Support, fit_surface, local_ellipsoid
from ..geometry import Outline, OutlinePoint
from ..geometry.pose import Array
from .scene import Cost, Model, Object, Push, Scene

# Of a start region: so often the offset that pushes are proved for is widened, by this part, as they change.
TILTS, WIDER = 3, 0.02


def named(scene: Scene, name: str) -> Push:
    """The push of a scene that has a name."""
    for push in scene.pushes:
        if isinstance(push, Push) and push.name == name:
            return push
    raise FlatpushError(f"the plan uses a push {name!r} that its scene does not list")


def placement_of(scene: Scene, push: Push) -> Placement:
    """The fingertips of a push, in O. Raises InputError where they do not fit."""
    return _placed(scene.object.outline, push.at, push.fingers, push.spacing, scene.pusher.tip_radius)


def contacts_of(scene: Scene, placement: Placement) -> tuple[PointContact, ...]:
    """The contacts of the fingertips as they are, in B (O's axes, origin at the COF)."""
    return _contacts(scene.object, placement)


def virtual_contact(scene: Scene, placement: Placement) -> PointContact:
    """The contact that a push is planned with, in B: the fingertip's own, or the virtual middle of two (Sec. 4.2)."""
    return _virtual(scene.object, placement)


def takes_cone(scene: Scene, fingers: int) -> bool:
    """Whether a push with so many fingers makes the motions of their composite cone (two_finger: cone)."""
    return fingers == 2 and scene.planning.two_finger == "cone"


def cone_motions(
    scene: Scene,
    placement: Placement,
    surface: LimitSurface,
    margin: float | None = None,
    *,
    quick: bool = False,
) -> Array:
    """Left turn, straight motion and right turn of two fingers' composite cone about the COF, shape (3, 3).

    They suit the scene's cost; the margin is the scene's unless given. See contact.cone_twists.
    """
    planning = scene.planning
    share = planning.friction_margin if margin is None else margin
    motions = _cone_motions(scene.object, placement, surface, share, planning.cost, quick)
    if not proved_for_set(scene):
        return motions
    side = side_of(scene, placement) if starts_anywhere(scene) else None
    return _set_motions(scene.object, placement, side, share, motions.tobytes())


def proved_for_set(scene: Scene) -> bool:
    """Whether pushes must hold for every table of a set."""
    return scene.object.uncertainty is not None and scene.planning.proof == "set"


def starts_anywhere(scene: Scene) -> bool:
    """Whether the object starts anywhere in a region."""
    return scene.object.uncertainty is not None and scene.object.uncertainty.start is not None


def side_of(scene: Scene, placement: Placement) -> Side:
    """The straight side that two fingers push at. Raises InputError where they push at none."""
    return _side(scene.object.outline, placement, scene.pusher.approach)


def first_landing(scene: Scene, side: Side, tilt: float) -> Landing:
    """What is left of the start region after a landing at a side (see contact.landing.landing).

    Raises:
        InputError: as that.
    """
    return _first_landing(scene.object, side, round(tilt, 9))


def slider_of(thing: Object) -> Array:
    """Corners (n, 2) that enclose the object, about its COF; of a circle, of a polygon around it."""
    outline = thing.outline
    if not outline.is_circle:
        return np.asarray(outline.vertices - thing.cof)
    turns = 2 * np.pi * np.arange(360) / 360
    ring = outline.radius / np.cos(np.pi / 360) * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return np.asarray(outline.centre + ring - thing.cof)


def contact_at(scene: Scene, at: OutlinePoint) -> PointContact:
    """The contact of one fingertip at a point of the outline, in B."""
    return PointContact(at.point - scene.object.cof, at.normal, scene.object.friction, hook=True)


def true_surface(thing: Object) -> LimitSurface:
    """The limit surface that is believed: the known one, else the support's own."""
    return thing.surface if thing.surface is not None else _exact(thing.support)


def surface_of(thing: Object, model: Model, direction: Array) -> LimitSurface:
    """The limit surface of a model, about the COF.

    Args:
        model: exact (the known surface, else the support's own), ellipsoid or quartic (fitted to that one over fixed
            low-discrepancy twists), local (Eqs. 2-3, corrected) about a straight push.
        direction: from the contact to the COF, shape (2,); used by the local model.
    """
    surface = true_surface(thing)
    if model == "exact":
        return surface
    if model == "local":
        return _local(thing, (float(direction[0]), float(direction[1])))
    if isinstance(surface, Ellipsoid if model == "ellipsoid" else Quartic):
        return surface
    return _fitted(thing, model)


def surface_at(scene: Scene, contact: PointContact, model: Model | None = None) -> LimitSurface:
    """The limit surface of a model (default: the scene's) for pushes at a contact in B; see surface_of."""
    distance = float(np.hypot(*contact.point))
    towards = -contact.point / distance if distance > 0 else contact.normal
    return surface_of(scene.object, model or scene.planning.model, towards)


def local_rho(thing: Object, direction: Array) -> float:
    """ρ = a/b of the local model about a straight push along a unit direction [m²]; of a support's pressure, nᵀΣn."""
    if thing.surface is None:
        return float(direction @ thing.support.covariance @ direction)
    matrix = local_ellipsoid(thing.surface, direction).matrix
    return float(matrix[0, 0] / matrix[2, 2])


def divergence_length(thing: Object, contact: PointContact) -> float:
    """L = r + ρ/r [m]: a small error of the bearing contact → COF grows e-fold per L of travel of one finger."""
    r = float(np.hypot(*contact.point))
    return r + local_rho(thing, -contact.point / r) / r


@lru_cache(maxsize=256)
def _virtual(thing: Object, placement: Placement) -> PointContact:
    return PointContact(
        placement.virtual_point - thing.cof, placement.virtual_normal, thing.friction, hook=True
    )


@lru_cache(maxsize=256)
def _contacts(thing: Object, placement: Placement) -> tuple[PointContact, ...]:
    return tuple(
        PointContact(point - thing.cof, normal, thing.friction, hook=True)
        for point, normal in zip(placement.points, placement.normals, strict=True)
    )


@lru_cache(maxsize=256)
def _placed(outline: Outline, at: OutlinePoint, fingers: int, spacing: float, tip_radius: float) -> Placement:
    return place_fingers(outline, at, fingers, spacing, tip_radius)


@lru_cache(maxsize=256)
def _cone_motions(
    thing: Object, placement: Placement, surface: LimitSurface, margin: float, cost: Cost, quick: bool
) -> Array:
    places = placement.tips if cost == "time" else placement.pose[None, :2]
    contacts = _contacts(thing, placement)
    motions = cone_twists(contacts, surface, margin, places - thing.cof, cost, quick=quick)
    motions.setflags(write=False)
    return motions


@lru_cache(maxsize=256)
def _set_motions(
    thing: Object, placement: Placement, side: Side | None, margin: float, nominal: bytes
) -> Array:
    assert thing.uncertainty is not None
    known = thing.uncertainty
    low = known.friction[0] if known.friction else thing.friction
    motions = np.frombuffer(nominal).reshape(3, 3)
    offset = 0.0
    for _ in range(TILTS):
        if side is not None:
            # How much is left of a start depends on how the straight motion stands to the side.
            left = _left_of_start(thing, side, side.tilt(motions[1, :2]))
            if left <= offset:
                break
            offset = left * (1 + WIDER)
        bounds = Bounds(known.loads, low, known.offset + offset)
        motions = proved_twists(
            thing.support, _contacts(thing, placement), margin, np.frombuffer(nominal).reshape(3, 3), bounds
        )
        if side is None:
            break
    motions.setflags(write=False)
    return motions


def _left_of_start(thing: Object, side: Side, tilt: float) -> float:
    """The offset that a push is proved for [m]: what a first landing leaves, or, of a push that only comes later, as
    much as the start is off."""
    assert thing.uncertainty is not None
    assert thing.uncertainty.start is not None
    try:
        return _first_landing(thing, side, round(tilt, 9)).offset
    except InputError:
        return thing.uncertainty.start.position


@lru_cache(maxsize=256)
def _side(outline: Outline, placement: Placement, approach: float) -> Side:
    return Side.of(outline, placement, approach)


@lru_cache(maxsize=1024)
def _first_landing(thing: Object, side: Side, tilt: float) -> Landing:
    assert thing.uncertainty is not None
    assert thing.uncertainty.start is not None
    return landing(
        TableSet.of(thing.support, thing.uncertainty.loads), thing.cof, side, thing.uncertainty.start, tilt
    )


@lru_cache(maxsize=64)
def _exact(support: Support) -> LimitSurface:
    return Exact(support.centred())


@lru_cache(maxsize=256)
def _local(thing: Object, direction: tuple[float, float]) -> LimitSurface:
    return local_ellipsoid(true_surface(thing), np.array(direction))


@lru_cache(maxsize=64)
def _fitted(thing: Object, model: Model) -> LimitSurface:
    return fit_surface(true_surface(thing), "ellipsoid" if model == "ellipsoid" else "quartic")
