"""What a plan claims, computed from its scene and its segments alone."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..contact import Placement, PointContact, beyond_slider, composite_margin, steering_forces
from ..friction.surface import LimitSurface
from ..geometry import compose, exp, log, pose_error, relative, rotate, shift_twist, transform, velocity_at
from ..geometry.pose import Array
from ..problem import PushSegment, Scene, TransitSegment
from ..problem.mechanics import (
    cone_motions,
    contact_at,
    contacts_of,
    divergence_length,
    named,
    placement_of,
    slider_of,
    surface_of,
    takes_cone,
    true_surface,
    virtual_contact,
)
from .clearance import clearance_of
from .cone_margins import cone_margins
from .pieces import pieces, progress, turns_along

# Beyond this growth of a small error no open-loop push of one finger can be trusted (methods 1.17: ℓ/L ≈ 4).
TRUSTED_GROWTH = float(np.exp(4.0))
CONE_SAMPLES = 33


def certify(scene: Scene, segments: Sequence[PushSegment | TransitSegment]) -> dict[str, Any]:
    """The certificate of a plan.

    Returns:
        goal_error: final pose less the goal (x, y, θ) by integrating the arcs' twists [m, m, rad].
        friction_margin: worst over all twists, and over all forces consistent with each: the fraction of μ that can be
            lost before the contact slips, under the planning model (two fingers in the middle: the virtual contact;
            two fingers with their cone: before the twist leaves it).
        friction_margin_degrees: the same as an angle between force and cone edge.
        spacing_margin: two fingers with their cone: the fraction of their spacing that can be lost likewise, or twice
            the part of the load that the lighter finger bears at least; else null.
        motion_cone_margin_degrees: angle between the pusher's velocity and the nearer motion-cone edge, or the
            outline's tangent, beyond which the fingertip leaves. Of a cone: by how much the velocity midway between
            the contacts may turn while ω stays.
        curvature_margin: 1 - turn per travel of the contact / the most among forces of the whole friction cone; of a
            composite cone, the most with the same velocity midway between the contacts.
        composite_margin: two fingers: the fraction of μ that can be lost before a twist leaves the true composite
            cone of both contacts, under the believed surface; null with one finger.
        uniqueness_margin: two fingers on a straight side: how far the turning centres used lie, at least, outside the
            strip square to the contact that encloses the object [m]. Where it is positive, sticking is the only motion
            that can happen, whatever the pressure ([Lynch1996] Theorem 4). null otherwise, and without a turn.
        model_offset: how far the believed surface's line of force passes from the contact, at worst [m]: 0 when the
            planning model is exact; null where two fingers use their cone.
        growth: one finger: factor e^(ℓ/L) by which a small error of the bearing contact → COF grows; null with two.
        clearance: least distance to obstacles and bounds [m]; null without any.
        cost, duration: recomputed. cars: turning centres and straight direction of each push used, in O.
        warnings: in words.
    """
    pushes = [s for s in segments if isinstance(s, PushSegment)]
    pose = np.asarray(scene.start, dtype=float)
    worst: dict[str, float] = {}
    cars: dict[str, Any] = {}
    judged: set[tuple[Any, ...]] = set()
    cost, growth, previous = 0.0, None, None
    for segment in pushes:
        placement = placement_of(scene, named(scene, segment.push))
        contact = virtual_contact(scene, placement)
        surface = surface_of(scene.object, scene.planning.model, -contact.point / np.hypot(*contact.point))
        cone = takes_cone(scene, len(segment.fingers))
        if segment.push not in cars:
            cars[segment.push] = (
                _of_twists(scene, cone_motions(scene, placement, surface))
                if cone
                else _centres(scene, contact, surface)
            )
        for twist, at in _twists(scene, segment, contact):
            # Margins depend on the direction of a twist, and a push has few of them.
            what = (segment.push, *np.round(twist / max(float(np.linalg.norm(twist)), 1e-300), 12), *at.point)
            if what in judged:
                continue
            judged.add(what)
            found = (_cone_margins if cone else _margins)(scene, surface, at, twist, placement)
            for key, value in found.items():
                worst[key] = min(worst.get(key, np.inf), value)
        cost += sum(arc_costs(scene, segment, cars[segment.push]))
        cost += scene.planning.switching if previous not in (None, segment.push) else 0.0
        previous = segment.push
        for arc in segment.arcs:
            pose = compose(pose, exp(arc.duration * arc.twist))
        if len(segment.fingers) == 1:
            length = sum(float(np.hypot(*velocity_at(shift_twist(a.twist, scene.object.cof), contact.point)))
                         * a.duration for a in segment.arcs)  # fmt: skip
            factor = float(np.exp(length / divergence_length(scene.object, contact)))
            growth = max(growth or 1.0, factor)
    duration = float(sum(s.times[-1] for s in segments))
    transits = [s for s in segments if isinstance(s, TransitSegment)]
    if scene.planning.cost == "time":
        cost += sum(float(s.times[-1]) for s in transits)
    elif scene.planning.cost == "pusher":
        cost += sum(_transit_length(s) for s in transits)
    offset = worst.get("minus_offset")
    certificate: dict[str, Any] = {
        "goal_error": [float(x) for x in pose_error(pose, scene.goal)],
        "cost": float(cost),
        "duration": duration,
        "friction_margin": worst.get("friction"),
        "friction_margin_degrees": worst.get("degrees"),
        "spacing_margin": worst.get("spacing"),
        "motion_cone_margin_degrees": worst.get("motion"),
        "curvature_margin": worst.get("curvature"),
        "composite_margin": worst.get("composite"),
        "uniqueness_margin": worst.get("unique"),
        "model_offset": None if offset is None else -offset,
        "growth": growth,
        "clearance": clearance_of(scene, segments),
        "cars": cars,
    }
    certificate["warnings"] = _warnings(certificate)
    return certificate


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


def _margins(
    scene: Scene, surface: LimitSurface, contact: PointContact, twist: Array, placement: Placement
) -> dict[str, float]:
    """The margins of one twist about the COF."""
    forces = contact.forces(surface.wrench_set(twist))
    angle = float(np.max(np.abs(contact.force_angles(forces))))
    mu = contact.friction
    u = velocity_at(twist, contact.point)
    left, right = contact.motion_cone(surface)
    lean = abs(float(contact.force_angles(u)))
    motion = min(_angle(right, u), _angle(u, left), 0.5 * np.pi - lean)
    margins = {
        "friction": 1 - float(np.tan(min(angle, 1.57))) / mu if mu > 0 else -9.0,
        "degrees": float(np.rad2deg(contact.half_angle - angle)),
        "motion": float(np.rad2deg(motion)),
        "curvature": _curvature_margin(surface, contact, twist),
    }
    true = true_surface(scene.object)
    if len(placement.points) == 2:
        margins |= _two_finger_margins(scene, placement, twist)
    W = true.wrench(twist)
    lever = W[2] - (contact.point[0] * W[1] - contact.point[1] * W[0])
    size = float(np.hypot(W[0], W[1]))
    free = true.wrench_set(twist).radius
    margins["minus_offset"] = -float(abs(lever) / size) if size > 0 and free == 0 else 0.0
    return margins


def _cone_margins(
    scene: Scene, surface: LimitSurface, contact: PointContact, twist: Array, placement: Placement
) -> dict[str, float]:
    """The margins of one twist about the COF, of two fingers with their composite cone."""
    contacts = contacts_of(scene, placement)
    return cone_margins(contacts, surface, contact.point, twist) | _two_finger_margins(
        scene, placement, twist
    )


def _two_finger_margins(scene: Scene, placement: Placement, twist: Array) -> dict[str, float]:
    """What both contacts make of a twist under the believed surface, and whatever the pressure."""
    contacts = contacts_of(scene, placement)
    margins = {"composite": composite_margin(contacts, true_surface(scene.object), twist)}
    beyond = beyond_slider(contacts, slider_of(scene.object), twist)
    if beyond is not None and np.isfinite(beyond):
        margins["unique"] = beyond
    return margins


def _curvature_margin(surface: LimitSurface, contact: PointContact, twist: Array) -> float:
    """Turn per travel of the contact, against the most that forces in the whole cone make on the same side.

    The most need not be at the cone's edge, so the cone is sampled.
    """
    if twist[2] == 0:
        return 1.0
    angles = np.linspace(-contact.half_angle, contact.half_angle, CONE_SAMPLES)
    V = np.array([surface.twist(contact.wrench(rotate(angle, contact.normal))) for angle in angles])
    turns = V[:, 2] / np.linalg.norm(velocity_at(V, contact.point), axis=1)
    turn = float(twist[2]) / float(np.hypot(*velocity_at(twist, contact.point)))
    most = float(np.max(turns) if turn > 0 else np.min(turns))
    return 1 - turn / most if most * turn > 0 else -9.0


def _of_twists(scene: Scene, twists: Array) -> dict[str, list[float]]:
    """Turning centres and straight direction, in O, of a left turn, a straight motion and a right turn."""
    centres = np.stack([-twists[:, 1], twists[:, 0]], axis=1)[[0, 2]] / twists[[0, 2], 2:] + scene.object.cof
    names = {"left_centre": centres[0], "right_centre": centres[1], "straight": twists[1, :2]}
    return {name: [float(x) for x in value] for name, value in names.items()}


def _centres(scene: Scene, contact: PointContact, surface: LimitSurface) -> dict[str, list[float]]:
    """Turning centres of the margin-shrunk friction cone, and the straight direction, in O."""
    left, straight, right = steering_forces(contact, surface, scene.planning.friction_margin)
    centres = []
    for force in (left, right):
        V = surface.twist(contact.wrench(force))
        centres.append(np.array([-V[1], V[0]]) / V[2] + scene.object.cof)
    v = surface.twist(contact.wrench(straight))[:2]
    names = {"left_centre": centres[1], "right_centre": centres[0], "straight": v / np.hypot(*v)}
    return {name: [float(x) for x in value] for name, value in names.items()}


def arc_costs(scene: Scene, segment: PushSegment, car: dict[str, list[float]]) -> list[float]:
    """Cost of each arc of a push: length of the way of the flat point or of the pusher, or its time."""
    if scene.planning.cost == "time":
        return [arc.duration for arc in segment.arcs]
    if scene.planning.cost == "flat":
        point = 0.5 * (np.array(car["left_centre"]) + np.array(car["right_centre"]))
    elif turns_along(segment):
        point = relative(segment.object[0], segment.pusher[0])[:2]
    else:
        steps = np.linalg.norm(np.diff(segment.pusher[:, :2], axis=0), axis=1)
        costs = [0.0] * len(segment.arcs)
        for step, (arc, _, _) in zip(steps, progress(segment), strict=True):
            costs[arc] += float(step)
        return costs
    return [float(np.hypot(*velocity_at(arc.twist, point))) * arc.duration for arc in segment.arcs]


def _transit_length(segment: TransitSegment) -> float:
    way = np.column_stack([segment.pusher[:, :2], segment.height])
    return float(np.sum(np.linalg.norm(np.diff(way, axis=0), axis=1)))


def _angle(a: Array, b: Array) -> float:
    """From a counter-clockwise to b."""
    return float(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b))


def _warnings(certificate: dict[str, Any]) -> list[str]:
    found = []
    growth = certificate["growth"]
    if growth is not None and growth > TRUSTED_GROWTH:
        found.append(
            f"one finger: a small error grows {growth:.3g}-fold on the way; this push cannot be trusted without"
            " feedback. Push with two fingers, or from nearer"
        )
    elif growth is not None and growth > 10:
        found.append(
            f"one finger: a small error grows {growth:.0f}-fold on the way; land precisely or use feedback"
        )
    composite = certificate["composite_margin"]
    if composite is not None and composite < 0:
        found.append(
            "two fingers: under the believed limit surface a motion needs more friction than the two contacts have;"
            " the object will slip. Plan with model: exact"
        )
    offset = certificate["model_offset"]
    if composite is None and offset is not None and offset > 1e-6:
        found.append(
            f"the planning model is not the believed surface: its line of force passes the contact at"
            f" {1000 * offset:.2f} mm, so the object will drift from the plan"
        )
    return found


def sample_errors(scene: Scene, segments: Sequence[PushSegment | TransitSegment]) -> dict[str, float]:
    """How well the samples agree with the arcs, the fingers with the outline, and the motion with its limits.

    Returns:
        start: distance of the first pose from the start, and of each push's from where the last one ended.
        path: largest distance of an object sample from its arcs [m or rad].
        fingers: largest error of the fingertips' place on the outline [m].
        jump: largest jump of the pusher between segments [m or rad].
        transit: deepest overlap of a fingertip with the resting object while the pusher moves on the table [m].
        speed: largest mean speed of a fingertip between samples, over the limit.
        clock: largest step back in time [s].
    """
    errors = dict.fromkeys(("start", "path", "fingers", "jump", "transit", "speed", "clock"), 0.0)
    pose = np.asarray(scene.start, dtype=float)
    hand: Array | None = None
    limits = scene.pusher
    for k, segment in enumerate(segments):
        if isinstance(segment, PushSegment):
            placement = placement_of(scene, named(scene, segment.push))
            errors["start"] = max(errors["start"], _most(segment.object[0], pose))
            tips = transform(placement.pose, segment.fingers)
            errors["fingers"] = max(errors["fingers"], float(np.max(np.abs(tips - placement.tips))))
            if turns_along(segment):
                on = np.array([relative(o, p) for o, p in zip(segment.object, segment.pusher, strict=True)])
                errors["fingers"] = max(errors["fingers"], float(np.max(_differences(on, placement.pose))))
            else:
                gaps = [
                    scene.object.outline.nearest(relative(o, p)[:2]).distance - limits.tip_radius
                    for o, p in zip(segment.object, segment.pusher, strict=True)
                ]
                errors["fingers"] = max(errors["fingers"], float(np.max(np.abs(gaps))))
            if turns_along(segment):
                for piece, end in zip(pieces([segment], segment.object[0]), segment.object[1:], strict=True):
                    errors["path"] = max(errors["path"], _most(piece.object_at(1.0), end))
            for arc in segment.arcs:
                pose = compose(pose, exp(arc.duration * arc.twist))
            errors["path"] = max(errors["path"], _most(segment.object[-1], pose))
            speeds = _tip_speeds(segment.times, segment.pusher, segment.fingers)
        else:
            around = next(
                (s for s in [*reversed(segments[:k]), *segments[k:]] if isinstance(s, PushSegment)), None
            )
            tips = np.zeros((1, 2)) if around is None else around.fingers
            speeds = _tip_speeds(segment.times, segment.pusher, tips)
            errors["transit"] = max(errors["transit"], _overlap(scene, segment, pose, tips))
        errors["speed"] = max(errors["speed"], float(np.max(speeds, initial=0.0)) / limits.speed)
        errors["clock"] = max(errors["clock"], float(np.max(-np.diff(segment.times), initial=0.0)))
        if hand is not None:
            errors["jump"] = max(errors["jump"], _most(segment.pusher[0], hand))
        hand = segment.pusher[-1]
    return errors


def _overlap(scene: Scene, segment: TransitSegment, pose: Array, fingers: Array) -> float:
    """How deep a fingertip on the table gets into the object, at most [m]."""
    outline, radius = scene.object.outline, scene.pusher.tip_radius
    low = segment.height <= 0
    tips = [transform(relative(pose, X), fingers) for X in segment.pusher[low]]
    return (
        max((radius - outline.nearest(tip).distance for tip in np.concatenate(tips)), default=0.0)
        if tips
        else 0.0
    )


def _most(a: Array, b: Array) -> float:
    return float(np.max(np.abs(pose_error(a, b))))


def _differences(poses: Array, target: Array) -> Array:
    return np.abs(pose_error(poses, target))


def _tip_speeds(times: Array, pusher: Array, fingers: Array) -> Array:
    dt = np.diff(times)
    tips = np.stack([transform(X, fingers) for X in pusher])
    moved = np.linalg.norm(np.diff(tips, axis=0), axis=-1).max(axis=-1)
    return np.where(dt > 0, moved / np.where(dt > 0, dt, 1.0), np.where(moved > 1e-12, np.inf, 0.0))
