"""Whether a plan holds for every table of a set, and for how large a set it does."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..contact import PointContact, WrenchCone
from ..contact.table_set import TableSet, side_along
from ..contact.uniqueness import rivals_depth
from ..errors import InputError
from ..geometry import perpendicular, rotate, shift_twist
from ..geometry.pose import Array
from ..problem import Plan, PushSegment, Scene
from ..problem.certificate import SetBounds, SetWorst, TubePart
from ..problem.mechanics import contacts_of, named, placement_of
from ..problem.scene import Uncertainty

# A ray lies on a face of its cone within this; numbers of a stated table are those of one within that.
ON_FACE, EXACT = 1e-9, 1e-6


@dataclass(frozen=True, eq=False)
class Proof:
    """Whether both fingers keep the object in every push of a plan, on every table of a set.

    Attributes:
        proved: whether they do.
        margin: the least depth in the fingers' composite cone over all motions and tables, a number without unit (see
            WrenchCone.depth).
        loads: the largest share by which loads may differ at every point so that the plan still holds, with the same
            friction and offset; 0 where it does not hold for the nominal loads.
        unique: how far every other motion of the object is from being possible, a depth without unit (see
            contact.uniqueness.rivals_depth): above 0, sticking is all that can happen; None on sides not straight.
        bounds, nearest: the set, and its table that comes nearest to letting the object slip, as in a certificate.
    """

    proved: bool
    margin: float
    loads: float
    unique: float | None
    bounds: SetBounds
    nearest: SetWorst

    @property
    def points(self) -> Array:
        """Feet or middles of patches in O, shape (n, 2) [m]."""
        return np.array(self.nearest.points)

    @property
    def worst(self) -> Array:
        """Their loads on that table, shape (n,), of sum 1."""
        return np.array(self.nearest.loads)


def prove(plan: Plan, loads: float = 0.2, *, friction: float | None = None, offset: float = 0.0) -> Proof:
    """Proves that the object stays in the hand during a plan, whatever the loads within a share of the nominal ones.

    It is decided for all loads at once (see contact.table_set), not for drawn ones. Sticking under the least friction
    of the fingers implies it for all more.

    Args:
        plan: solved, every push with two fingers.
        loads: δ: pressure times table friction is within (1 ± δ) of its nominal value at every point; in [0, 1).
        friction: the least Coulomb coefficient between fingertip and object; default: the object's.
        offset: the fingers may stand so far along a straight side from where the plan wants them, either way [m].

    Raises:
        InputError: for a plan without a push, one finger, a known limit surface in the place of loads, an offset on a
            side that is not straight, and numbers that make no sense.

    >>> import flatpush as fp
    >>> thing = fp.Object([(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)])
    >>> push = fp.Push("side", thing.outline.nearest((0.0, -0.0175)), fingers=2, spacing=0.018)
    >>> scene = fp.Scene(thing, (0.0, -0.1, 0.0), pusher=fp.Pusher(fingers=2, spacing=0.018), pushes=(push,))
    >>> proof = prove(fp.plan(scene), 0.05)
    >>> proof.proved, round(proof.loads, 2)
    (True, 0.72)
    """
    scene = plan.scene
    if not plan.pushes:
        raise InputError("there is no push to prove in this plan", value=plan.status)
    for segment in plan.pushes:
        if len(segment.fingers) != 2:
            raise InputError(
                "only pushes of two fingers hold for a set of tables", key=f"push {segment.push!r}",
                value=len(segment.fingers), hint="One finger needs feedback: flatpush track.",
            )  # fmt: skip
    most = scene.object.friction
    if friction is not None and not 0 < friction <= most:
        raise InputError(f"the least friction is above 0 and at most the object's, {most:g}", value=friction)
    known = Uncertainty(loads, None if friction is None else (friction, most), offset)
    found = proof_of(replace(scene, object=replace(scene.object, uncertainty=known)), plan.pushes)
    assert found is not None
    return found


def proof_of(
    scene: Scene, pushes: Sequence[PushSegment], tube: Sequence[TubePart] | None = None
) -> Proof | None:
    """The proof for the uncertainty of the scene's object; None without one, without a motion or with one finger.

    Args:
        tube: of the plan, where there is one: it says how far the object is off along the fingers.
    """
    known = scene.object.uncertainty
    if known is None or any(len(segment.fingers) != 2 for segment in pushes):
        return None
    margins, loads, uniques, offsets = [], 1.0, list[float](), [0.0]
    found: list[tuple[TableSet, WrenchCone, Array, int, int]] = []
    for number, segment in enumerate(pushes):
        moving = [i for i, arc in enumerate(segment.arcs) if arc.duration > 0]
        if not moving:
            continue
        offset = known.offset if tube is None else tube[number].offset
        contacts, cone, held = _grasp(scene, segment.push, offset)
        twists = np.array([shift_twist(segment.arcs[i].twist, scene.object.cof) for i in moving])
        for tables in held:
            found += [(tables, cone, V, number, i) for i, V in zip(moving, twists, strict=True)]
            margins += tables.margin(cone, twists).tolist()
            loads = min(loads, float(np.min(tables.largest(cone, twists))))
        offsets.append(offset)
        kinds = np.unique(np.round(twists / np.linalg.norm(twists, axis=1)[:, None], 12), axis=0)
        unique = rivals_depth(held, contacts, kinds)
        uniques += [] if unique is None else [unique]
    if not found:
        return None
    least = int(np.argmin(margins))
    tables, cone, twist, number, arc = found[least]
    worst = tables.worst(cone, twist)
    side = perpendicular(contacts_of(scene, placement_of(scene, named(scene, pushes[number].push)))[0].normal)
    x, y, torque = worst.face.tolist()
    nearest = SetWorst(
        number, pushes[number].push, arc, float(tables.support.centre @ side), worst.depth,
        _gives_way(cone, worst.face), (x, y, torque / cone.lever),
        tuple((px, py) for px, py in _points(scene, tables).tolist()), tuple(worst.loads.tolist()),
    )  # fmt: skip
    bounds = SetBounds(known.loads, _least_friction(scene), max(offsets))
    return Proof(margins[least] >= 0, margins[least], loads, min(uniques, default=None), bounds, nearest)


def worst_depth(scene: Scene, pushes: Sequence[PushSegment], stated: SetWorst) -> float | None:
    """The depth of a stated table under a stated face; None of what is no table or no face of the set."""
    known = scene.object.uncertainty
    if known is None or not 0 <= stated.number < len(pushes):
        return None
    segment = pushes[stated.number]
    if segment.push != stated.push or not 0 <= stated.arc < len(segment.arcs):
        return None
    contacts, cone, (tables,) = _grasp(scene, segment.push, 0.0)
    tables = tables.placed(stated.offset * side_along(contacts, stated.offset))
    loads, face = np.array(stated.loads), np.array(stated.face) * [1.0, 1.0, cone.lever]
    if loads.shape != tables.weights.shape or abs(float(np.sum(loads)) - 1) > EXACT:
        return None
    if np.any(np.abs(loads - tables.weights) > known.loads * tables.weights + EXACT):
        return None
    near = np.linalg.norm(cone.faces - face, axis=1)
    if np.min(near) > EXACT or _gives_way(cone, cone.faces[int(np.argmin(near))]) != stated.gives_way:
        return None
    if np.max(np.abs(np.array(stated.points) - _points(scene, tables))) > EXACT:
        return None
    return tables.loaded(cone, shift_twist(segment.arcs[stated.arc].twist, scene.object.cof), face, loads)


def _grasp(
    scene: Scene, push: str, offset: float
) -> tuple[list[PointContact], WrenchCone, tuple[TableSet, ...]]:
    """Contacts with the least friction, their cone, and the set where the object is off by up to an offset [m]."""
    known = scene.object.uncertainty
    assert known is not None
    mu = _least_friction(scene)
    contacts = [replace(c, friction=mu) for c in contacts_of(scene, placement_of(scene, named(scene, push)))]
    tables = TableSet.of(scene.object.support, known.loads)
    return contacts, WrenchCone.of(contacts), tables.held(side_along(contacts, offset), offset)


def _points(scene: Scene, tables: TableSet) -> Array:
    """Feet or middles of patches in O, wherever the object is held, shape (n, 2) [m]."""
    return np.asarray(tables.points - tables.support.centre + scene.object.cof)


def _least_friction(scene: Scene) -> float:
    known = scene.object.uncertainty
    return scene.object.friction if known is None or known.friction is None else known.friction[0]


def _gives_way(cone: WrenchCone, face: Array) -> str:
    """What happens where a wrench passes a face of the cone of two fingers, the left one first: in words."""
    left, also, right, too = np.abs(cone.rays @ face) <= ON_FACE
    if left and also:
        return "the right finger lets go"
    if right and too:
        return "the left finger lets go"
    if left and right:
        return "both fingers slide to the left"
    if also and too:
        return "both fingers slide to the right"
    return "the fingers slide apart" if left and too else "the fingers slide together"


def offset_end(scene: Scene, push: PushSegment) -> tuple[float, float]:
    """Half the sides, in x and y, of the box in which the object ends about the planned end of a push [m].

    An object whose side rests against both fingers has lost the errors of its angle and of its distance; what stays is
    an offset along the side, by which it is carried beside its plan, turned as planned.
    """
    known = scene.object.uncertainty
    if known is None or known.offset == 0:
        return (0.0, 0.0)
    contacts = contacts_of(scene, placement_of(scene, named(scene, push.push)))
    x, y = known.offset * np.abs(rotate(push.object[-1, 2], perpendicular(contacts[0].normal)))
    return float(x), float(y)
