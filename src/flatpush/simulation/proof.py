"""Whether a plan holds for every table of a set, and for how large a set it does."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..contact import WrenchCone
from ..contact.table_set import TableSet, shifted
from ..errors import InputError
from ..geometry import perpendicular, rotate, shift_twist
from ..geometry.pose import Array
from ..problem import Plan, PushSegment, Scene
from ..problem.certificate import TubePart
from ..problem.mechanics import contacts_of, named, placement_of
from ..problem.scene import Uncertainty


@dataclass(frozen=True, eq=False)
class Proof:
    """Whether both fingers keep the object in every push of a plan, on every table of a set.

    Attributes:
        proved: whether they do.
        margin: the least depth in the fingers' composite cone over all motions and tables, a number without unit (see
            WrenchCone.depth).
        loads: the largest share by which loads may differ at every point so that the plan still holds, with the same
            friction and offset; 0 where it does not hold for the nominal loads.
        push, arc: name of the push and number of its arc where the margin is least.
        points, worst: feet or middles of patches in O, shape (n, 2) [m], and their loads on the worst table, (n,).
    """

    proved: bool
    margin: float
    loads: float
    push: str
    arc: int
    points: Array
    worst: Array


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
    mu = scene.object.friction if known.friction is None else known.friction[0]
    tables = TableSet.of(scene.object.support, known.loads)
    margins, loads, found = [], 1.0, list[tuple[WrenchCone, Array, str, int]]()
    for number, segment in enumerate(pushes):
        contacts = contacts_of(scene, placement_of(scene, named(scene, segment.push)))
        offset = known.offset if tube is None else tube[number].offset
        moving = [i for i, arc in enumerate(segment.arcs) if arc.duration > 0]
        if not moving:
            continue
        twists = np.array([shift_twist(segment.arcs[i].twist, scene.object.cof) for i in moving])
        for pair in shifted([replace(c, friction=mu) for c in contacts], offset):
            cone = WrenchCone.of(pair)
            found += [(cone, V, segment.push, i) for i, V in zip(moving, twists, strict=True)]
            margins += tables.margin(cone, twists).tolist()
            loads = min(loads, float(np.min(tables.largest(cone, twists))))
    if not found:
        return None
    worst = int(np.argmin(margins))
    cone, twist, push, number = found[worst]
    return Proof(
        margins[worst] >= 0,
        margins[worst],
        loads,
        push,
        number,
        tables.points + scene.object.cof,
        tables.worst(cone, twist).loads,
    )


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
