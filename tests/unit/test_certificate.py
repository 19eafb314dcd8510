"""The numbers of the certificate, each computed another way: closed forms, or brute force over forces."""

from dataclasses import replace

import numpy as np
import pytest

import flatpush as fp
from flatpush.contact import PointContact, composite_margin, spacing_margin, two_point_sticks
from flatpush.friction import Ellipsoid, Exact, Support
from flatpush.geometry import exp, rotate, shift_twist, velocity_at
from flatpush.problem import TransitSegment
from flatpush.simulation import certify
from flatpush.simulation.claims import TRUSTED_GROWTH
from flatpush.simulation.clearance import clearance_of
from flatpush.simulation.cone_margins import cone_margins
from flatpush.simulation.margins import Margins, worse_of

MU, R, A, B = 0.4, 0.0175, 1.0, 1 / 2e-4  # an ellipsoid diag(a, a, b) about the COF, pushed from a distance R
BLOCK = [(-0.025, -0.0175), (0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175)]


def one_finger(margin, start=(0.01, -0.12, 0.3), **planning):
    thing = fp.Object(BLOCK, friction=MU, surface=Ellipsoid(np.diag([A, A, B])))
    pushes = (fp.Push("below", thing.outline.at(0, 0.5)),)
    settings = fp.Planning(friction_margin=margin, iterations=1, **planning)
    return fp.plan(fp.Scene(thing, start, pushes=pushes, planning=settings))


@pytest.mark.parametrize("margin", [0.0, 0.2, 0.37])
def test_the_friction_margin_is_one_less_tangent_over_mu(margin):
    """By the forces of the twists: V = A F, so that F = (vx, vy, ω a/b) / a; no function of contact is asked."""
    plan = one_finger(margin)
    tangents = []
    for arc in plan.pushes[0].arcs:
        v = shift_twist(arc.twist, plan.scene.object.cof)
        tangents.append(abs(v[0] / v[1]))
    assert plan.certificate.friction_margin == pytest.approx(1 - max(tangents) / MU, abs=1e-12)
    assert plan.certificate.friction_margin == pytest.approx(margin, abs=1e-12)
    degrees = np.degrees(np.arctan(MU) - np.arctan(max(tangents)))
    assert plan.certificate.friction_margin_degrees == pytest.approx(degrees, abs=1e-9)


def test_the_model_offset_is_how_far_the_line_of_force_passes_from_the_contact():
    """The table's force summed over feet: each resists against its own velocity. Planned with the fitted ellipsoid."""
    feet = np.array([(-0.018, -0.012), (0.02, -0.01), (0.0, 0.014)])
    thing = fp.Object(BLOCK, fp.Support.points(feet), friction=MU)
    pushes = (fp.Push("below", thing.outline.at(0, 0.5)),)
    plan = fp.plan(
        fp.Scene(
            thing,
            (0.01, -0.12, 0.3),
            pushes=pushes,
            planning=fp.Planning(model="ellipsoid", iterations=1),
        )
    )
    offsets = []
    for arc in plan.pushes[0].arcs:
        vx, vy, w = arc.twist
        v = np.stack([vx - w * feet[:, 1], vy + w * feet[:, 0]], axis=1)
        forces = v / np.linalg.norm(v, axis=1)[:, None] / 3
        arms = feet - np.array([0.0, -R])
        torque = np.sum(arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0])
        offsets.append(abs(torque) / np.linalg.norm(forces.sum(axis=0)))
    assert max(offsets) > 1e-5
    assert plan.certificate.model_offset == pytest.approx(max(offsets), rel=1e-9)
    assert any("passes the contact at" in text for text in plan.certificate.warnings)


def test_the_clearance_is_kept_between_two_samples_far_apart():
    """A spike that a fingertip passes at 10 mm, half way between samples that are 10 cm from it."""
    plan = one_finger(0.2)
    spike = [(0.3, 0.06), (0.301, 0.1), (0.299, 0.1)]
    scene = replace(plan.scene, workspace=fp.Workspace(None, [spike]))
    past = TransitSegment(np.array([0.0, 9.0]), np.array([[0.2, 0.05, 0.0], [0.4, 0.05, 0.0]]), np.zeros(2))
    found = clearance_of(scene, (*plan.segments, past))
    assert found == pytest.approx(0.01 - scene.pusher.tip_radius, abs=1.1e-5)


def test_the_growth_is_e_to_the_way_over_the_length_of_divergence():
    """L = r + ρ/r with ρ = a/b; the way of the contact from the arcs, chord by chord."""
    plan = one_finger(0.2)
    way = 0.0
    contact = np.array([0.0, -R])
    for arc in plan.pushes[0].arcs:
        steps = exp(np.linspace(0, arc.duration, 2001)[:, None] * arc.twist)
        c, s = np.cos(steps[:, 2]), np.sin(steps[:, 2])
        places = steps[:, :2] + np.stack([-s * contact[1], c * contact[1]], axis=1)
        way += float(np.sum(np.linalg.norm(np.diff(places, axis=0), axis=1)))
    rho = A / B
    assert plan.certificate.growth == pytest.approx(np.exp(way / (R + rho / R)), rel=1e-5)


def test_a_growth_beyond_e_to_the_fourth_is_warned_of():
    assert pytest.approx(np.exp(4)) == TRUSTED_GROWTH
    near, far = one_finger(0.2, (0.0, -0.05, 0.1)), one_finger(0.2, (0.0, -0.4, 0.1))
    assert near.certificate.growth < np.exp(4) < far.certificate.growth < np.exp(30)
    assert not any("cannot be trusted" in text for text in near.certificate.warnings)
    assert any("cannot be trusted without" in text for text in far.certificate.warnings)


def test_the_motion_and_curvature_margins_are_those_of_the_ellipsoid():
    """Of diag(a, a, b): the contact at (0, -R) moves by (1 + R²/ρ) fx, fy; ω is b R fx."""
    plan = one_finger(0.2)
    rho = A / B
    lean, most = np.arctan((1 + R * R / rho) * 0.8 * MU), np.arctan((1 + R * R / rho) * MU)
    assert plan.certificate.motion_cone_margin_degrees == pytest.approx(np.degrees(most - lean), abs=1e-9)
    turn = [R * t / rho / np.hypot((1 + R * R / rho) * t, 1) for t in (0.8 * MU, MU)]
    assert plan.certificate.curvature_margin == pytest.approx(1 - turn[0] / turn[1], abs=1e-9)


def test_cost_duration_and_goal_error_are_those_of_the_arcs():
    plan = one_finger(0.2)
    push = plan.pushes[0]
    X = np.eye(3)
    for x, y, angle in (plan.scene.start_pose, *(exp(arc.duration * arc.twist) for arc in push.arcs)):
        c, s = np.cos(angle), np.sin(angle)
        X = X @ np.array([[c, -s, x], [s, c, y], [0, 0, 1]])
    assert plan.certificate.goal_error[:2] == pytest.approx(X[:2, 2], abs=1e-12)
    assert plan.certificate.goal_error[2] == pytest.approx(np.arctan2(X[1, 0], X[0, 0]), abs=1e-12)
    car = plan.certificate.cars["below"]
    flat = 0.5 * (np.array(car.left_centre) + np.array(car.right_centre))
    way = sum(np.hypot(*velocity_at(arc.twist, flat)) * arc.duration for arc in push.arcs)
    assert plan.certificate.cost == pytest.approx(way)
    assert plan.certificate.duration == pytest.approx(sum(segment.times[-1] for segment in plan.segments))


@pytest.mark.parametrize("kind", ["rim", "feet"])
def test_one_finger_keeps_its_friction_margin_on_the_exact_table(kind):
    """Among all forces at the contact the one that balances the table's friction, summed over points that press on it;
    and with less friction than is said to be enough the finger slides, with a little more it does not."""
    feet = np.array([(-0.018, -0.012), (0.02, -0.01), (0.0, 0.014)])
    if kind == "rim":
        ends = np.array(BLOCK)
        lengths = np.linalg.norm(np.roll(ends, -1, axis=0) - ends, axis=1)
        share = (np.arange(20_000) + 0.5)[:, None] / 20_000
        points = np.concatenate(
            [a + share * (b - a) for a, b in zip(ends, np.roll(ends, -1, axis=0), strict=True)]
        )
        loads = np.repeat(lengths / lengths.sum() / 20_000, 20_000)
    else:
        points, loads = feet, np.full(3, 1 / 3)
    thing = fp.Object(BLOCK, "outline" if kind == "rim" else fp.Support.points(feet), friction=MU)
    pushes = (fp.Push("below", thing.outline.at(0, 0.5)),)
    planning = fp.Planning(friction_margin=0.2, iterations=1)
    plan = fp.plan(fp.Scene(thing, (0.01, -0.12, 0.3), pushes=pushes, planning=planning))
    contact, angles = np.array([0.0, -R]), np.linspace(-np.arctan(MU), np.arctan(MU), 400_001)
    forces, needed = np.stack([np.sin(angles), np.cos(angles)], axis=1), []
    for arc in plan.pushes[0].arcs:
        vx, vy, w = arc.twist
        v = np.stack([vx - w * points[:, 1], vy + w * points[:, 0]], axis=1)
        friction = loads[:, None] * v / np.linalg.norm(v, axis=1)[:, None]
        arms = points - contact
        torque = np.sum(arms[:, 0] * friction[:, 1] - arms[:, 1] * friction[:, 0])
        assert abs(torque) < 1e-7  # about the contact, whose force has none [m]
        size = forces @ friction.sum(axis=0)
        off = np.linalg.norm(size[:, None] * forces - friction.sum(axis=0), axis=1)
        needed.append(np.tan(abs(angles[np.argmin(off)])))
    margin = plan.certificate.friction_margin
    assert margin == pytest.approx(1 - max(needed) / MU, abs=5e-6)  # of the angles
    assert margin == pytest.approx(0.2, abs=1e-9)
    for part, sticks in ((1.002, True), (0.98, False)):
        slippery = replace(thing, friction=part * (1 - margin) * MU)
        run = fp.simulate(replace(plan, scene=replace(plan.scene, object=slippery)))
        assert any(mode.startswith("sliding") for mode in run.modes) is not sticks


def test_the_cars_turn_about_the_centres_of_the_ellipsoid():
    """At the edges of 0.8 μ: V = A F with F = (t, 1, R t), about (-vy, vx) / ω; and so do the arcs that are driven."""
    plan = one_finger(0.2)
    rho, car = A / B, plan.certificate.cars["below"]
    assert car.left_centre == pytest.approx((-rho / (R * 0.8 * MU), rho / R), abs=1e-12)
    assert car.right_centre == pytest.approx((rho / (R * 0.8 * MU), rho / R), abs=1e-12)
    assert car.straight == pytest.approx((0.0, 1.0), abs=1e-12)
    for arc in plan.pushes[0].arcs:
        vx, vy, w = arc.twist
        centre = {"left": car.left_centre, "right": car.right_centre}.get(arc.turn)
        if centre is None:
            assert (vx, w) == pytest.approx((0.0, 0.0), abs=1e-12)
        else:
            assert (-vy / w, vx / w) == pytest.approx(centre, abs=1e-12)


def pair(rng):
    turns = rng.uniform(-0.5, 0.5, 2) * rng.integers(0, 2)
    places = [np.array([x, -0.015]) for x in (0.009, -0.009)] + rng.uniform(-0.01, 0.01, 2)
    return [
        PointContact(p, [np.sin(t), np.cos(t)], rng.uniform(0.2, 0.7) if k else 0.5, hook=True)
        for k, (p, t) in enumerate(zip(places, turns, strict=True))
    ]


@pytest.mark.parametrize("seed", range(20))
def test_the_margins_of_two_fingers_are_where_brute_force_finds_their_ends(seed):
    """A grid of squeezes: of all forces that make the wrench, those that need the least friction."""
    rng = np.random.default_rng(seed)
    first, second = pair(rng)
    contacts = [PointContact(c.point, c.normal, 0.5, hook=True) for c in (first, second)]
    surface = Ellipsoid(np.diag([1.0, 1.0, 5000.0]))
    leaning = contacts[0].normal + np.array([0.1, 0.0])
    F = contacts[0].wrench(leaning) + rng.uniform(0.3, 1) * contacts[1].wrench(contacts[1].normal)
    twist = surface.twist(F)
    frames = [(c.normal, np.array([-c.normal[1], c.normal[0]])) for c in contacts]
    G = np.array([c.wrench(f) for c, frame in zip(contacts, frames, strict=True) for f in frame]).T
    x, z = np.linalg.lstsq(G, surface.wrench(twist), rcond=None)[0], np.linalg.svd(G)[2][3]
    least = np.inf
    for width in (10.0, 0.1, 1e-3, 1e-5):
        forces = x + np.linspace(-width, width, 4001)[:, None] * np.linalg.norm(x) * z
        a, b = forces[:, 0::2], np.abs(forces[:, 1::2])
        need = np.where(np.all(a > 1e-12, axis=1), np.max(b / np.where(a > 1e-12, a, 1.0), axis=1), np.inf)
        best = int(np.argmin(need))
        least, x = min(least, float(need[best])), forces[best]
    assert composite_margin(contacts, surface, twist) == pytest.approx(1 - least / 0.5, abs=1e-5)


@pytest.mark.parametrize("seed", range(10))
def test_two_fingers_on_a_side_may_lose_the_spacing_that_is_said(seed):
    """Nearer together by the margin they still hold the motion, nearer by more they do not."""
    rng = np.random.default_rng(seed)
    surface = Ellipsoid(np.diag([1.0, 1.0, 5000.0]))

    def at(spacing):
        return [PointContact([x, -0.015], [0.0, 1.0], 0.5) for x in (0.5 * spacing, -0.5 * spacing)]

    twist = surface.twist(
        at(0.018)[0].wrench([rng.uniform(-0.3, 0.3), 1.0]) * 0.8 + at(0.018)[1].wrench([0.0, 0.2])
    )
    margin = spacing_margin(at(0.018), surface, twist)
    assert 0 < margin < 1
    assert two_point_sticks(at(0.018 * (1 - margin + 1e-5)), surface, twist)
    assert not two_point_sticks(at(0.018 * (1 - margin - 1e-5)), surface, twist)


def test_the_motion_of_two_fingers_may_turn_by_what_is_said():
    contacts = [PointContact([x, -0.015], [0.0, 1.0], 0.5) for x in (0.009, -0.009)]
    surface, middle = Ellipsoid(np.diag([1.0, 1.0, 5000.0])), np.array([0.0, -0.015])
    twist = np.array([0.01, 0.03, 0.5])
    found = cone_margins(surface, [contacts], middle[None], twist[None])[0]
    u = velocity_at(twist, middle)

    def sticks(degrees, tighter=1.0):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        v, w = np.array([c * u[0] - s * u[1], s * u[0] + c * u[1]]), twist[2] * tighter
        return two_point_sticks(contacts, surface, np.array([v[0] + w * middle[1], v[1] - w * middle[0], w]))

    assert all(sticks(side * (found.motion - 1e-3)) for side in (1, -1))
    assert not all(sticks(side * (found.motion + 1e-3)) for side in (1, -1))
    assert sticks(0.0, 1 / (1 - found.curvature) - 1e-4)
    assert not sticks(0.0, 1 / (1 - found.curvature) + 1e-4)


def test_the_worse_of_two_margins_is_taken_one_by_one():
    a = Margins(friction=0.3, motion=2.0, offset=0.001, unique=-0.01)
    b = Margins(friction=0.2, motion=3.0, offset=0.002, composite=0.5)
    assert worse_of(a, b) == Margins(friction=0.2, motion=2.0, offset=0.002, unique=-0.01, composite=0.5)
    assert worse_of(b, a) == worse_of(a, b)


def test_where_a_turn_is_certain_the_uniqueness_margin_is_positive():
    """[Lynch1996] Theorem 4: the turning centre lies beyond the strip, square to the contact, that holds the object."""
    for start, sign in (((0.0, -0.3, 0.3), 1), ((0.06, 0.02, 2.6), -1)):
        thing = fp.Object(BLOCK, friction=0.4)
        pushes = (fp.Push("below", thing.outline.at(0, 0.5), 2, 0.018),)
        planning = fp.Planning(friction_margin=0.9 if sign > 0 else 0.0, iterations=1)
        pusher = fp.Pusher(fingers=2, spacing=0.018)
        plan = fp.plan(fp.Scene(thing, start, (0, 0, 0), pusher, pushes, planning=planning))
        assert plan.status == "solved"
        beyond = []
        for arc in plan.pushes[0].arcs:
            _, vy, w = arc.twist
            if w != 0:
                beyond.append(abs(-vy / w) - 0.025)
        assert plan.certificate.uniqueness_margin == pytest.approx(min(beyond), abs=1e-9)
        assert np.sign(plan.certificate.uniqueness_margin) == sign


def test_no_certificate_without_a_push_has_margins():
    scene = fp.Scene(fp.Object(BLOCK), (0.0, 0.0, 0.0))
    certificate = certify(scene, ())
    assert certificate.friction_margin is None
    assert certificate.cost == certificate.duration == 0


def test_motions_judged_together_are_where_one_after_the_other_they_leave_the_cone():
    """Every step on the way out by two_point_sticks alone, halved between the last inside and the first outside."""
    rng = np.random.default_rng(3)
    surface = Exact(Support.outline([(-0.02, -0.015), (0.02, -0.015), (0.0, 0.03)]).centred())
    pairs, twists = [], []
    for spacing in (0.012, 0.02):
        contacts = [PointContact([x, -0.015], [0.1, 1.0], 0.5) for x in (0.5 * spacing, -0.5 * spacing)]
        for share in rng.uniform(0.2, 0.8, 2):
            F = share * contacts[0].wrench([0.1, 1.0]) + (1 - share) * contacts[1].wrench([-0.05, 1.0])
            pairs.append(contacts)
            twists.append(surface.twist(F))
    twists.append(surface.twist([0.01, -1.0, 0.0]))  # pulls: outside the cone
    pairs.append(pairs[0])
    middle = np.array([0.0, -0.015])
    found = cone_margins(surface, pairs, np.tile(middle, (5, 1)), np.array(twists))

    def leaves(contacts, way, most):
        def outside(s):
            return not two_point_sticks(contacts, surface, way(s))

        first = next((k for k in range(1, 65) if outside(most * k / 64)), None)
        if first is None:
            return most
        low, high = most * (first - 1) / 64, most * first / 64
        for _ in range(45):
            half = 0.5 * (low + high)
            low, high = (low, half) if outside(half) else (half, high)
        return low

    for contacts, V, margins in zip(pairs[:4], twists[:4], found[:4], strict=True):

        def turned(angle, tighter=0.0, V=V):
            u, w = rotate(angle, velocity_at(V, middle)), V[2] * np.exp(tighter)
            return np.array([*(u - velocity_at([0.0, 0.0, w], middle)), w])

        sides = [leaves(contacts, lambda s, side=side: turned(side * s), np.pi) for side in (1, -1)]
        log = leaves(contacts, lambda s: turned(0.0, s), np.log(64))
        assert np.radians(margins.motion) == pytest.approx(min(sides), abs=2e-8)  # the cone's relative slack
        assert margins.curvature == pytest.approx(1 - np.exp(-log), abs=2e-8)
        assert margins.friction == pytest.approx(composite_margin(contacts, surface, V), abs=1e-12)
        assert margins.spacing == pytest.approx(spacing_margin(contacts, surface, V), abs=1e-12)
    assert found[4].friction < 0
    assert found[4].motion == -180
    assert found[4].curvature == -np.inf
