"""What a plan claims, computed from its scene and its segments alone."""

from collections.abc import Sequence
from functools import lru_cache, reduce

import numpy as np

from ..contact import PointContact, steering_forces
from ..contact.cone_twists import RESERVE
from ..errors import InputError
from ..friction.surface import LimitSurface
from ..geometry import compose, exp, log, relative, rotate, shift_twist, velocity_at
from ..geometry.pose import Array
from ..problem import (
    CarCentres,
    Certificate,
    Object,
    PushSegment,
    Scene,
    Segment,
    SlideSegment,
    TransitSegment,
)
from ..problem.mechanics import (
    cone_motions,
    contact_at,
    divergence_length,
    named,
    placement_of,
    surface_at,
    takes_cone,
    virtual_contact,
)
from ..problem.scene import Uncertainty
from .clearance import clearance_of
from .judged_motions import JudgedMotion, margins_of
from .margins import Margins, worse_of
from .pieces import progress, turns_along
from .proof import offset_end, proof_of
from .slides import plant_of_slides, rolled_out, sensitivity_of
from .tube import tube_of

# Beyond this growth of a small error no open-loop push of one finger can be trusted (methods 1.17: ℓ/L ≈ 4).
TRUSTED_GROWTH = float(np.exp(4.0))


# A plan for two fingers that keeps less than RESERVE is told so: between its samples it may need what it lacks.
NO_RESERVE = (
    "two fingers: next to no friction is kept in reserve, and straight between samples a robot may lose the object."
    f" Plan with margin: {{friction: {RESERVE:g}}} at least"
)
# What every plan with slides is told with.
LESS_CERTAIN = (
    "pushes that slide are less certain than pushes that stick: look after each, as flatpush track does"
)


def certify(scene: Scene, segments: Sequence[Segment]) -> Certificate:
    """The certificate of a plan, from its scene and its segments alone.

    Raises:
        FlatpushError: for a push that the scene does not list or whose fingers do not fit.
    """
    pushes = [s for s in segments if isinstance(s, PushSegment)]
    pose = np.asarray(scene.start, dtype=float)
    cars: dict[str, CarCentres] = {}
    motions: list[JudgedMotion] = []
    cost, growth, previous = 0.0, None, None
    slides = any(isinstance(s, SlideSegment) for s in segments)
    plant = plant_of_slides(scene) if slides else None
    for segment in segments:
        if isinstance(segment, TransitSegment):
            continue
        cost += scene.planning.switching if previous not in (None, segment.push) else 0.0
        previous = segment.push
        if isinstance(segment, SlideSegment):
            assert plant is not None
            pose = rolled_out(plant, pose, segment.pusher).object[-1]
            cost += slide_cost(scene, segment)
            continue
        placement = placement_of(scene, named(scene, segment.push))
        contact = virtual_contact(scene, placement)
        surface = surface_at(scene, contact)
        cone = takes_cone(scene, len(segment.fingers))
        if segment.push not in cars:
            cars[segment.push] = (
                _of_twists(scene, cone_motions(scene, placement, surface))
                if cone
                else _centres(scene.object, contact, surface, scene.planning.friction_margin)
            )
        for twist, at in _twists(scene, segment, contact):
            motions.append(JudgedMotion.of(placement, surface, cone, at, twist))
        cost += sum(arc_costs(scene, segment, cars[segment.push]))
        for arc in segment.arcs:
            pose = compose(pose, exp(arc.duration * arc.twist))
        if len(segment.fingers) == 1:
            length = sum(float(np.hypot(*velocity_at(shift_twist(a.twist, scene.object.cof), contact.point)))
                         * a.duration for a in segment.arcs)  # fmt: skip
            factor = float(np.exp(length / divergence_length(scene.object, contact)))
            growth = max(growth or 1.0, factor)
    worst = reduce(worse_of, margins_of(scene, motions), Margins())
    transits = [s for s in segments if isinstance(s, TransitSegment)]
    if scene.planning.cost == "time":
        cost += sum(float(s.times[-1]) for s in transits)
    elif scene.planning.cost == "pusher":
        cost += sum(_transit_length(s) for s in transits)
    known, no_tube = scene.object.uncertainty or Uncertainty(), ""
    try:
        tube = tube_of(scene, segments)
    except InputError as error:
        tube, no_tube = None, f"it is not said where the object ends from every start: {error}"
    proof, clearance = proof_of(scene, pushes, tube), clearance_of(scene, segments)
    set_end = set_clearance = None
    if tube:
        set_end = tube[-1].end
        if clearance is not None:
            set_clearance = min([clearance, *(p.clearance for p in tube if p.clearance is not None)])
    elif proof is not None and known.start is None:
        set_end = offset_end(scene, pushes[-1])
        set_clearance = None if clearance is None else clearance - known.offset
    x, y, angle = (float(value) for value in scene.goal_error(pose))
    return Certificate(
        goal_error=(x, y, angle),
        cost=float(cost),
        duration=float(sum(s.times[-1] for s in segments)),
        friction_margin=worst.friction,
        friction_margin_degrees=worst.degrees,
        spacing_margin=worst.spacing,
        motion_cone_margin_degrees=worst.motion,
        curvature_margin=worst.curvature,
        composite_margin=worst.composite,
        uniqueness_margin=worst.unique,
        model_offset=worst.offset,
        set_margin=None if proof is None else proof.margin,
        set_loads=None if proof is None else proof.loads,
        set_bounds=None if proof is None else proof.bounds,
        set_worst=None if proof is None else proof.nearest,
        set_uniqueness=None if proof is None else proof.unique,
        set_end=set_end,
        set_clearance=set_clearance,
        tube=tube,
        growth=growth,
        sensitivity=sensitivity_of(scene, segments),
        clearance=clearance,
        cars=cars,
        warnings=(
            *_warnings(scene, growth, worst),
            *((LESS_CERTAIN,) if slides else ()),
            *((no_tube,) if no_tube else ()),
        ),
    )


def _twists(scene: Scene, segment: PushSegment, contact: PointContact) -> list[tuple[Array, PointContact]]:
    """The body twists of a push, about the COF, each with the contact at which it happens.

    Where the pusher keeps its direction the contact rolls along, and every step between samples is a twist.
    """
    if turns_along(segment):
        return [
            (shift_twist(arc.twist, scene.object.cof), contact) for arc in segment.arcs if arc.duration > 0
        ]
    found = []
    for i in range(len(segment.times) - 1):
        V = log(relative(segment.object[i], segment.object[i + 1]))
        if np.linalg.norm(V) < 1e-12:
            continue
        middle = compose(segment.object[i], exp(0.5 * V))
        tip = 0.5 * (segment.pusher[i, :2] + segment.pusher[i + 1, :2])
        at = scene.object.outline.nearest(rotate(-middle[2], tip - middle[:2]))
        found.append((shift_twist(V, scene.object.cof), contact_at(scene, at)))
    return found


def _of_twists(scene: Scene, twists: Array) -> CarCentres:
    """Turning centres and straight direction, in O, of a left turn, a straight motion and a right turn."""
    centres = np.stack([-twists[:, 1], twists[:, 0]], axis=1)[[0, 2]] / twists[[0, 2], 2:] + scene.object.cof
    return CarCentres(_pair(centres[0]), _pair(centres[1]), _pair(twists[1, :2]))


@lru_cache(maxsize=256)
def _centres(thing: Object, contact: PointContact, surface: LimitSurface, margin: float) -> CarCentres:
    """Turning centres of the margin-shrunk friction cone, and the straight direction, in O."""
    left, straight, right = steering_forces(contact, surface, margin)
    centres = []
    for force in (left, right):
        V = surface.twist(contact.wrench(force))
        centres.append(np.array([-V[1], V[0]]) / V[2] + thing.cof)
    v = surface.twist(contact.wrench(straight))[:2]
    return CarCentres(_pair(centres[1]), _pair(centres[0]), _pair(v / np.hypot(*v)))


def _pair(values: Array) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def arc_costs(scene: Scene, segment: PushSegment, car: CarCentres) -> list[float]:
    """Cost of each arc of a push: length of the way of the flat point or of the pusher, or its time."""
    if scene.planning.cost == "time":
        return [arc.duration for arc in segment.arcs]
    if scene.planning.cost == "flat":
        point = 0.5 * (np.array(car.left_centre) + np.array(car.right_centre))
    elif turns_along(segment):
        point = relative(segment.object[0], segment.pusher[0])[:2]
    else:
        steps = np.linalg.norm(np.diff(segment.pusher[:, :2], axis=0), axis=1)
        costs = [0.0] * len(segment.arcs)
        for step, (arc, _, _) in zip(steps, progress(segment), strict=True):
            costs[arc] += float(step)
        return costs
    return [float(np.hypot(*velocity_at(arc.twist, point))) * arc.duration for arc in segment.arcs]


def slide_cost(scene: Scene, segment: SlideSegment) -> float:
    """Cost of a slide: the length of the finger's way, or its time."""
    if scene.planning.cost == "time":
        return float(segment.times[-1])
    return float(np.sum(np.linalg.norm(np.diff(segment.pusher[:, :2], axis=0), axis=1)))


def _transit_length(segment: TransitSegment) -> float:
    way = np.column_stack([segment.pusher[:, :2], segment.height])
    return float(np.sum(np.linalg.norm(np.diff(way, axis=0), axis=1)))


def _warnings(scene: Scene, growth: float | None, worst: Margins) -> list[str]:
    found = []
    if growth is not None and growth > TRUSTED_GROWTH:
        found.append(
            f"one finger: a small error grows {growth:.3g}-fold on the way; this push cannot be trusted without"
            " feedback. Push with two fingers, or from nearer"
        )
    elif growth is not None and growth > 10:
        found.append(
            f"one finger: a small error grows {growth:.0f}-fold on the way; land precisely or use feedback"
        )
    kept = worst.composite
    if scene.planning.friction_margin < RESERVE and kept is not None and kept < RESERVE:
        found.append(NO_RESERVE)
    if worst.composite is not None and worst.composite < 0:
        found.append(
            "two fingers: under the believed limit surface a motion needs more friction than the two contacts have;"
            " the object will slip. Plan with model: exact"
        )
    if worst.composite is None and worst.offset is not None and worst.offset > 1e-6:
        found.append(
            f"the planning model is not the believed surface: its line of force passes the contact at"
            f" {1000 * worst.offset:.2f} mm, so the object will drift from the plan"
        )
    return found
