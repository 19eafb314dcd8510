"""One fingertip, two fingertips, and where they stand."""

import numpy as np
import pytest

from flatpush.contact import (
    PointContact,
    composite_margin,
    place_fingers,
    steering_forces,
    straight_force,
    two_point_sticks,
)
from flatpush.contact.placement import travels
from flatpush.errors import InputError, NoDubinsReduction
from flatpush.friction import CollinearSupportWarning, Ellipsoid, Exact, Support, local_ellipsoid
from flatpush.friction.surface import WrenchSet
from flatpush.geometry import Outline, perpendicular, rotate, velocity_at
from flatpush.geometry.pose import cross

ISOTROPIC = Ellipsoid(np.diag([1.0, 1.0, 4.0]))
TRIANGLE = Outline.polygon([(0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095)])


def test_forces_of_a_facet_pass_through_the_contact():
    """Each end of the chord is a wrench of the set, with the greatest free force and no torque about the contact."""
    rng, chords = np.random.default_rng(3), 0
    for _ in range(200):
        contact = PointContact([rng.normal(), -rng.uniform(0.1, 2.0)], [0.0, 1.0], 0.5)
        free, radius = rng.normal(size=2), 1.0
        force = rng.normal(size=2)
        # A wrench of the set passes through the contact: the middle one plus some free force.
        inside = rotate(rng.uniform(-np.pi, np.pi), np.array([rng.uniform(0, 0.9), 0.0]))
        torque = cross(contact.point, force + inside) - cross(free, inside)
        for end in contact.forces(WrenchSet(np.array([*force, torque]), free, radius)):
            own = end - force
            assert np.hypot(*own) == pytest.approx(radius)
            assert torque + cross(free, own) == pytest.approx(cross(contact.point, end), abs=1e-12)
            chords += 1
    assert chords == 400


def test_left_is_left_as_seen_along_the_inward_normal():
    contact = PointContact([0.0, -1.0], [0.0, 1.0], 0.5)
    left, right = contact.force_edges()
    np.testing.assert_allclose(left, np.array([-0.5, 1.0]) / np.hypot(0.5, 1.0))  # Eq. 10: |fx| = μ fy
    np.testing.assert_allclose(right, left * [-1, 1])
    # The force on the left edge turns the object clockwise (contract).
    assert contact.wrench(left)[2] < 0 < contact.wrench(right)[2]
    u_left, u_right = contact.motion_cone(ISOTROPIC)
    assert u_left[0] < 0 < u_right[0]


@pytest.mark.parametrize(
    ("velocity", "mode"),
    [
        ((0.0, 1.0), "sticking"),
        ((-3.0, 1.0), "sliding_left"),
        ((3.0, 1.0), "sliding_right"),
        ((0.0, -1.0), "separation"),
        ((0.0, 0.0), "rest"),
        ((1.0, 0.0), "sliding_right"),
        ((-1.0, 0.0), "sliding_left"),
    ],
)
def test_modes(velocity, mode):
    contact = PointContact([0.0, -1.0], [0.0, 1.0], 0.5)
    motion = contact.motion(ISOTROPIC, velocity)
    assert motion.mode == mode
    normal_velocity = velocity_at(motion.twist, contact.point) @ contact.normal
    if velocity[1] >= 0:
        assert normal_velocity == pytest.approx(velocity[1])
    if mode.startswith("sliding"):
        assert np.sign(motion.slip) == (1 if mode == "sliding_left" else -1)


def test_the_edges_of_the_motion_cone_stick():
    contact = PointContact([0.3, -1.0], [0.0, 1.0], 0.5)
    for edge in contact.motion_cone(ISOTROPIC):
        assert contact.motion(ISOTROPIC, edge).mode == "sticking"


def test_without_friction_the_force_is_normal():
    contact = PointContact([0.0, -1.0], [0.0, 1.0], 0.0)
    assert contact.motion(ISOTROPIC, (0.0, 1.0)).mode == "sticking"
    motion = contact.motion(ISOTROPIC, (0.5, 1.0))
    assert motion.mode == "sliding_right"
    assert motion.twist == pytest.approx([0.0, 1.0, 0.0])


def test_a_foot_under_the_centre_of_rotation_leaves_its_force_free():
    """A rotation about a foot has many wrenches; the contact forces consistent with it are a chord."""
    support = Support.points([(1.0, 0.0), (-0.5, 0.8), (-0.5, -0.8)], [1, 1, 1]).centred()
    surface = Exact(support)
    foot = support.feet[0][0]
    twist = np.array([foot[1], -foot[0], 1.0])
    wrenches = surface.wrench_set(twist)
    # A contact on the line of force of one of these wrenches.
    f = wrenches.centre[:2]
    line = perpendicular(f) * -wrenches.centre[2] / (f @ f)
    contact = PointContact(line - 1.5 * f, f, 1.0, hook=True)
    ends = contact.forces(wrenches)
    assert wrenches.radius == pytest.approx(1 / 3)
    for force in ends:
        free = force - wrenches.centre[:2]
        assert np.hypot(*free) == pytest.approx(wrenches.radius)
        whole = wrenches.centre + np.array([*free, foot[0] * free[1] - foot[1] * free[0]])
        assert whole == pytest.approx(contact.wrench(force))
    assert np.ptp(contact.force_angles(ends)) > 0.01


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([0, -1], [0, 0], 0.3), "not zero"),
        (([0, -1], [0, -1], 0.3), "inward"),
        (([0, -1], [0, 1], -0.3), "0 or more"),
        (([0, -1], [0, float("nan")], 0.3), "finite"),
        (([0, -1, 2], [0, 1], 0.3), "two finite numbers"),
    ],
)
def test_bad_contacts_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        PointContact(*arguments)


def test_the_straight_force_of_an_asymmetric_contact_points_at_the_centre_of_friction():
    contact = PointContact([0.2, -1.0], [0.0, 1.0], 0.5)
    for surface in (ISOTROPIC, Exact(Support.polygon([(1, -1), (1, 1), (-1, 1), (-1, -1)]))):
        force = straight_force(contact, surface)
        assert force == pytest.approx(-contact.point / np.hypot(*contact.point))
        assert surface.twist(contact.wrench(force))[2] == pytest.approx(0, abs=1e-12)


def test_the_straight_force_of_a_full_ellipsoid_does_not_turn():
    surface = Ellipsoid([[1.0, 0.1, 0.2], [0.1, 1.3, -0.3], [0.2, -0.3, 2.0]])
    contact = PointContact([0.1, -1.0], [0.0, 1.0], 0.9)
    force = straight_force(contact, surface)
    assert surface.twist(contact.wrench(force))[2] == pytest.approx(0, abs=1e-12)
    assert force @ contact.normal > 0


def test_a_push_that_cannot_steer_says_by_how_many_degrees():
    contact = PointContact([0.5, -1.0], [0.0, 1.0], 0.3)
    with pytest.raises(NoDubinsReduction, match=r"off by 9\.9°") as caught:
        straight_force(contact, ISOTROPIC)
    assert caught.value.degrees == pytest.approx(np.rad2deg(np.arctan(0.5) - np.arctan(0.3)))


def test_collinear_feet_are_not_steered_by_a_push_square_to_their_line():
    with pytest.warns(CollinearSupportWarning):
        support = Support.points([(-0.02, 0.0), (0.02, 0.0)], [1, 1])
    surface = Exact(support)
    with pytest.raises(NoDubinsReduction, match="many motions"):
        steering_forces(PointContact([0.0, -0.02], [0.0, 1.0], 0.3), surface, 0.1)
    along = PointContact([-0.03, 0.0], [1.0, 0.0], 0.3)
    assert steering_forces(along, surface, 0.1)[1] == pytest.approx([1.0, 0.0])


def test_collinear_feet_have_no_local_model_square_to_their_line():
    """A division by zero, once: plans for two feet fell over their pushes square to the feet's line."""
    with pytest.warns(CollinearSupportWarning):
        support = Support.points([(-0.02, 0.0), (0.02, 0.0)], [1, 1])
    with pytest.raises(InputError, match="no local model"):
        local_ellipsoid(support, [0.0, 1.0])
    assert local_ellipsoid(support, [1.0, 0.0]).matrix[2, 2] == pytest.approx(1 / 0.0004)


@pytest.mark.parametrize("edge", ["left", "right", "above", "below"])
def test_two_fingers_fit_the_recorded_butterfly(data_folder, edge):
    """The authors' outline has concave sides; both tips must touch it there, square to the symmetric waist."""
    recorded = np.loadtxt(data_folder / "plan_graph" / "shape_butterfly.csv", delimiter=",", skiprows=1)
    outline = Outline.polygon(recorded)
    towards = {"left": (1, 0), "right": (-1, 0), "above": (0, -1), "below": (0, 1)}[edge]
    _, touched = travels(outline, -0.05 * np.array([towards]), np.array([towards], dtype=float), 0.0)
    middle = touched[0]
    at = outline.nearest(middle + 1e-6)  # not exactly at one of its many corners
    placement = place_fingers(outline, at, 2, 0.018, 0.0025)
    for tip, point in zip(placement.tips, placement.points, strict=True):
        assert outline.nearest(tip).distance == pytest.approx(0.0025, abs=1e-9)
        assert outline.nearest(point).distance == pytest.approx(0, abs=1e-9)
    assert placement.virtual_normal @ towards > 0.99
    # Both stand inside the side's hollow: nearer to the middle than the object's own half extent.
    assert np.all(-placement.tips @ towards < np.max(recorded @ -np.array(towards)) + 0.0025 + 1e-9)


def test_two_fingers_carry_what_one_cannot():
    contacts = [PointContact([x, -0.01], [0.0, 1.0], 0.3) for x in (0.009, -0.009)]
    surface = Exact(Support.polygon([(0.02, -0.01), (0.02, 0.01), (-0.02, 0.01), (-0.02, -0.01)]))
    assert two_point_sticks(contacts, surface, [0.0, 1.0, 0.0])
    assert not two_point_sticks(contacts, surface, [0.0, -1.0, 0.0])
    assert not two_point_sticks(contacts, surface, [0.0, 0.0, 1.0])
    # A turn about a far point beside the object sticks, one about a near point does not.
    assert two_point_sticks(contacts, surface, [0.0, 0.05, 1.0])
    assert not two_point_sticks(contacts, surface, [0.0, 0.004, 1.0])


def test_the_composite_margin_is_where_sticking_ends():
    contacts = [PointContact([x, -0.01], [0.0, 1.0], 0.3) for x in (0.009, -0.009)]
    twist = np.array([0.004, 0.02, 1.0])
    surface = Ellipsoid(np.diag([1.0, 1.0, 1 / 2e-4]))
    margin = composite_margin(contacts, surface, twist)
    assert 0 < margin < 1
    for scale, sticks in ((1 - margin + 1e-6, True), (1 - margin - 1e-6, False)):
        weaker = [PointContact(c.point, c.normal, scale * c.friction) for c in contacts]
        assert two_point_sticks(weaker, surface, twist) is sticks


def test_a_free_foot_widens_what_two_fingers_carry():
    """A rotation about a support point: any force of that foot up to its share may complete the wrench."""
    support = Support.points([(0.03, 0.0), (-0.02, 0.02), (-0.02, -0.02)], [2, 1, 1]).centred()
    surface = Exact(support)
    foot = support.feet[0][0]
    twist = np.array([foot[1], -foot[0], 1.0])
    rng = np.random.default_rng(3)
    free = surface.wrench_set(twist)
    widened = 0
    for _ in range(200):
        angle = rng.uniform(-np.pi, np.pi)
        point = -0.02 * rotate(angle, [0.0, 1.0])
        contacts = [
            PointContact(point + rotate(angle, [x, 0.0]), rotate(angle, [0.0, 1.0]), 0.3, hook=True)
            for x in (0.009, -0.009)
        ]
        sticks = two_point_sticks(contacts, surface, twist)
        # Brute force over the free force's disc.
        radii, angles = np.meshgrid(np.linspace(0, free.radius, 60), np.linspace(-np.pi, np.pi, 120))
        g = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=-1).reshape(-1, 2)
        F = free.centre + np.column_stack([g, foot[0] * g[:, 1] - foot[1] * g[:, 0]])
        rays = np.array([c.wrench(f) for c in contacts for f in c.force_edges()])
        normals = [np.cross(a, b) for i, a in enumerate(rays) for b in rays[i + 1 :]]
        facets = [n for n in normals if np.all(rays @ n >= -1e-15)] + [
            -n for n in normals if np.all(rays @ n <= 1e-15)
        ]
        inside = np.any(np.all(F @ np.array(facets).T >= 0, axis=1))
        centre_inside = np.all(np.array(facets) @ free.centre >= 0)
        assert sticks or not inside
        if sticks and not inside:  # the grid may miss a sliver
            near = np.max(
                np.min(F @ (np.array(facets) / np.linalg.norm(facets, axis=1, keepdims=True)).T, axis=1)
            )
            assert near > -0.02
        widened += bool(sticks and not centre_inside)
    assert widened > 0


def test_one_finger_stands_back_by_its_radius():
    at = TRIANGLE.at(0, 0.5)
    placement = place_fingers(TRIANGLE, at, 1, 0.0, 0.0025)
    assert TRIANGLE.nearest(placement.tips[0]).distance == pytest.approx(0.0025)
    assert rotate(placement.pose[2], [1.0, 0.0]) == pytest.approx(at.normal)


@pytest.mark.parametrize("edge", [0, 1, 2])
def test_two_fingers_on_an_edge_stand_square_to_it(edge):
    at = TRIANGLE.at(edge, 0.5)
    placement = place_fingers(TRIANGLE, at, 2, 0.018, 0.0025)
    assert placement.virtual_point == pytest.approx(at.point)
    assert placement.virtual_normal == pytest.approx(at.normal)
    for tip in placement.tips:
        assert TRIANGLE.nearest(tip).distance == pytest.approx(0.0025)
    # E's left is its +y: the first tip stands at +spacing/2.
    assert placement.tips[0] - placement.tips[1] == pytest.approx(
        0.018 * rotate(placement.pose[2], [0.0, 1.0])
    )


def test_two_fingers_fit_into_a_concave_side():
    waist = Outline.polygon(
        [(0.02, -0.02), (0.02, 0.02), (0.004, 0.006), (-0.02, 0.02), (-0.02, -0.02), (0.004, -0.006)]
    )
    at = waist.at(1, 0.8)
    placement = place_fingers(waist, at, 2, 0.012, 0.002)
    for tip, point in zip(placement.tips, placement.points, strict=True):
        assert waist.nearest(tip).distance == pytest.approx(0.002, abs=1e-9)
        assert np.hypot(*(tip - point)) == pytest.approx(0.002, abs=1e-9)


def test_two_fingers_on_a_circle():
    circle = Outline.circle(0.03)
    placement = place_fingers(circle, circle.at(0, 0.25), 2, 0.018, 0.0025)
    assert np.hypot(*placement.tips.T) == pytest.approx([0.0325, 0.0325])
    assert placement.virtual_normal == pytest.approx([0.0, -1.0])


@pytest.mark.parametrize(
    ("edge", "along", "spacing", "words"),
    [(0, 0.5, 0.05, "meets|touch|corner"), (0, 0.02, 0.018, "meets|touch|corner")],
)
def test_fingers_that_do_not_fit_are_refused(edge, along, spacing, words):
    with pytest.raises(InputError, match=words):
        place_fingers(TRIANGLE, TRIANGLE.at(edge, along), 2, spacing, 0.0025)
