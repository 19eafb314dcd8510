"""What was proved or measured about a plan."""

from collections.abc import Mapping
from dataclasses import dataclass, field

Vector = tuple[float, float]


@dataclass(frozen=True)
class CarCentres:
    """How a push steers, in O.

    Attributes:
        left_centre, right_centre: turning centres of its tightest left and right turn [m].
        straight: unit direction of its straight motion.
    """

    left_centre: Vector
    right_centre: Vector
    straight: Vector


@dataclass(frozen=True)
class TubePart:
    """Where the object is in one push, from wherever in the start region it began.

    Attributes:
        push: name of the push.
        gap: between a finger at its place and the object's side, at most; as deep it may stand in the way [m].
        travel: of the hand, straight on from its place, after which both fingers hold [m].
        offset: of the object from there on, along the side that is pushed, to either side at most; its angle and its
            distance from the hand are as planned [m].
        end: half the sides in x and y of the box about the planned end of the push that this makes [m].
        clearance: that is kept during the push, and while the object waits for it [m]; None with nothing around.
    """

    push: str
    gap: float
    travel: float
    offset: float
    end: Vector
    clearance: float | None = None


@dataclass(frozen=True)
class SetBounds:
    """The set of tables, fingers and places for which the margins of a set are.

    Attributes:
        loads: pressure times table friction is within this share of its nominal value at every point.
        friction: least Coulomb coefficient of the fingers; they hold for all above it too.
        offset: of the object along the side that is pushed, to either side at most, in the push where it is most [m].
    """

    loads: float
    friction: float
    offset: float


@dataclass(frozen=True)
class SetWorst:
    """The table of a set that comes nearest to letting the object slip, and what would give way.

    Attributes:
        number, push, arc: which of the plan's pushes, from 0, its name, and which of its arcs, from 0.
        offset: of the object along the side, to the left as seen along the push [m].
        depth: n · W of its wrench W and the face n, by the nominal wrench's size, torques by the cone's lever. Of feet
            without an offset it is the set's margin, which is else less by what the proof adds for patches and offsets.
        gives_way: in words, what happens beyond that face.
        face: n, the inward normal of the face of the fingers' composite cone, for forces and the torque about the
            nominal centre of friction, along O's axes (without unit, without unit, 1/m).
        points, loads: feet or middles of patches in O [m], and their loads in parts of the whole.
    """

    number: int
    push: str
    arc: int
    offset: float
    depth: float
    gives_way: str
    face: tuple[float, float, float]
    points: tuple[Vector, ...]
    loads: tuple[float, ...]


@dataclass(frozen=True)
class Certificate:
    """The numbers that simulation.certify computes from a scene and its segments; None where one does not apply.

    A margin that no friction and no spacing would give is -inf; the document writes it as null.

    Attributes:
        goal_error: final pose less the goal (x, y, θ) by integrating the arcs' twists [m, m, rad].
        cost: recomputed, in the unit of the plan's cost [m, or s for the cost "time"].
        duration: of all segments [s].
        friction_margin: worst over all twists, and over all forces consistent with each: the fraction of μ that can
            be lost before the contact slips, under the planning model (two fingers in the middle: the virtual
            contact; two fingers with their cone: before the twist leaves it).
        friction_margin_degrees: the same as an angle between force and cone edge [deg].
        spacing_margin: two fingers with their cone: the fraction of their spacing that can be lost likewise, or twice
            the part of the load that the lighter finger bears at least.
        motion_cone_margin_degrees: angle between the pusher's velocity and the nearer motion-cone edge, or the
            outline's tangent, beyond which the fingertip leaves. Of a cone: by how much the velocity midway between
            the contacts may turn while ω stays [deg].
        curvature_margin: 1 - turn per travel of the contact / the most among forces of the whole friction cone, a
            fraction; of a composite cone, the most with the same velocity midway between the contacts.
        composite_margin: two fingers: the fraction of μ that can be lost before a twist leaves the true composite
            cone of both contacts, under the believed surface.
        uniqueness_margin: two fingers on a straight side: how far the turning centres used lie, at least, outside
            the strip square to the contact that encloses the object [m]. Where it is positive, sticking is the only
            motion that can happen, whatever the pressure ([Lynch1996] Theorem 4). None without a turn.
        model_offset: how far the believed surface's line of force passes from the contact, at worst [m]: 0 when the
            planning model is exact; None where two fingers use their cone.
        set_margin: two fingers, where the object states an uncertainty: the least depth in their composite cone of all
            wrenches of all tables of that set (a sine, so a number without unit; see contact.table_set). Proved
            where it is not negative.
        set_loads: the largest share by which loads may differ so that the plan still holds, with the friction and
            offset of that set.
        set_bounds: that set.
        set_worst: its table that comes nearest to letting the object slip.
        set_uniqueness: how far every motion of the object but sticking is from being possible on every table of that
            set, a depth without unit: above 0, sticking is all that can happen (see contact.uniqueness); else that is
            not shown. None for fingers on sides that are not straight.
        set_end: half the sides of the box in x and y about the planned end in which the object ends with any offset of
            that set along the fingers, its angle being the planned one [m]; with a start region, from all of it.
        set_clearance: clearance that remains with any such offset [m]; with a start region, from all of it.
        tube: where the object is in each push, with a start region of which that could be said; else None.
        growth: one finger: the factor e^(ℓ/L) by which a small error of the bearing contact → COF grows.
        sensitivity: plans with slides: how far the outline's farthest point ends elsewhere, about, if the object starts
            beside ("place") [m/m] or turned ("turn") [m/rad], the finger has more or less friction ("friction") [m],
            or the centre of friction, and with it the pressure, lies beside ("centre") [m/m], in the worst direction.
        clearance: least distance to obstacles and bounds [m]; None without any.
        cars: of each push used, by its name.
        warnings: in words.
        others: keys of a document that this version does not know; verify cannot recompute them.
    """

    goal_error: tuple[float, float, float]
    cost: float
    duration: float
    friction_margin: float | None = None
    friction_margin_degrees: float | None = None
    spacing_margin: float | None = None
    motion_cone_margin_degrees: float | None = None
    curvature_margin: float | None = None
    composite_margin: float | None = None
    uniqueness_margin: float | None = None
    model_offset: float | None = None
    set_margin: float | None = None
    set_loads: float | None = None
    set_bounds: SetBounds | None = None
    set_worst: SetWorst | None = None
    set_uniqueness: float | None = None
    set_end: Vector | None = None
    set_clearance: float | None = None
    tube: tuple[TubePart, ...] | None = None
    growth: float | None = None
    sensitivity: Mapping[str, float] | None = None
    clearance: float | None = None
    cars: Mapping[str, CarCentres] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    others: Mapping[str, object] = field(default_factory=dict)
