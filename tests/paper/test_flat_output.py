"""[Zhou2017] Section 3: Proposition 1, Theorem 1, Eqs. 16-33, as printed where right, else corrected."""

import json

import numpy as np
import pytest

from flatpush.contact import ContactMode, PointContact
from flatpush.errors import InputError, NoDubinsReduction
from flatpush.friction import Ellipsoid
from flatpush.geometry import compose, cross, exp, perpendicular, rotate
from flatpush.steering import flat_output

a, b, r, mu = 1.3, 2400.0, 0.021, 0.45
rho = a / b
PAPER = Ellipsoid(np.diag([a, a, b]))


def paper_contact(tilt=0.0, friction=mu, frame=0.0):
    """A contact r below the COF, its normal tilted from the direction to the COF; all turned by `frame`."""
    return PointContact(rotate(frame, [0.0, -r]), rotate(frame + tilt, [0.0, 1.0]), friction)


def random_ellipsoid(rng, length=0.02):
    """Positive definite and full, eigenvalues within a factor of about ten in units of the length."""
    M = np.eye(3) + 0.35 * rng.normal(size=(3, 3))
    S = np.diag([1.0, 1.0, 1 / length])
    return Ellipsoid(S @ (M @ M.T) @ S)


def random_push(rng):
    """An ellipsoid and a contact that can steer: the straight force is inside the cone."""
    while True:
        surface = random_ellipsoid(rng)
        p = rotate(rng.uniform(-np.pi, np.pi), [0.0, -rng.uniform(0.01, 0.03)])
        contact = PointContact(p, rotate(rng.uniform(-0.4, 0.4), -p), rng.uniform(0.2, 0.9))
        try:
            return contact, surface, flat_output(contact, surface)
        except NoDubinsReduction:
            continue


def centre(contact, surface, force):
    V = surface.matrix @ contact.wrench(force)
    return np.array([-V[1], V[0]]) / V[2]


def in_cone(contact, rng, count):
    return rotate(rng.uniform(-1, 1, count) * contact.half_angle, contact.normal) * rng.uniform(
        0.5, 2, (count, 1)
    )


def flat_motion(contact, surface, flat, poses, forces, rates):
    """z, ż, z̈ of the flat point under forces and their rates, by the chain rule on Eq. 12."""
    V, dV = ((contact.wrench(f)) @ surface.matrix for f in (forces, rates))
    arm = perpendicular(flat.flat_point)
    v, dv = V[:, :2] + V[:, 2:] * arm, dV[:, :2] + dV[:, 2:] * arm
    theta = poses[:, 2]
    return flat.position(poses), rotate(theta, v), rotate(theta, dv + V[:, 2:] * perpendicular(v))


def test_the_equations_of_motion():
    """Eqs. 4-9 and 12-14, component by component, for forces at a contact r below the centre of friction."""
    contact, p_y = paper_contact(), -r
    J = np.array([[1.0, 0.0, -p_y], [0.0, 1.0, 0.0]])
    A = np.diag([a, a, b])
    for fx, fy in ((0.1, 1.0), (-0.3, 0.8), (0.0, 0.5)):
        V = PAPER.twist(contact.wrench([fx, fy]))  # up to a positive factor, which f absorbs
        V *= fy * a / V[1]
        np.testing.assert_allclose(V, [a * fx, a * fy, -b * p_y * fx], rtol=1e-12, atol=1e-15)  # Eqs. 4-6
        theta = 0.7
        x = a * (fx * np.cos(theta) - fy * np.sin(theta))  # Eqs. 7-9
        y = a * (fx * np.sin(theta) + fy * np.cos(theta))
        np.testing.assert_allclose([*rotate(theta, V[:2]), V[2]], [x, y, -b * p_y * fx], rtol=1e-12)
        u = J @ A @ J.T @ [fx, fy]  # Eq. 13
        motion = contact.motion(PAPER, u)
        assert motion.mode == ContactMode.STICKING
        np.testing.assert_allclose(motion.twist, V, rtol=1e-9, atol=1e-12)
    for edge, force in zip(contact.motion_cone(PAPER), ((-mu, 1.0), (mu, 1.0)), strict=True):
        wanted = J @ A @ J.T @ force  # Eq. 14
        np.testing.assert_allclose(edge / np.hypot(*edge), wanted / np.hypot(*wanted), rtol=1e-12)


@pytest.mark.parametrize("frame", [0.0, 1.1, -2.5])
def test_symmetric_case(frame):
    """Flat point (0, ρ/r) of the push frame, R = ρ/(r μ), heading from contact to COF (Eqs. 19, 20, 29)."""
    flat = flat_output(paper_contact(frame=frame), PAPER)
    np.testing.assert_allclose(flat.flat_point, rotate(frame, [0.0, rho / r]), atol=1e-15)
    assert flat.min_radius == pytest.approx(rho / (r * mu))
    assert np.exp(1j * flat.heading_offset) == pytest.approx(1j * np.exp(1j * frame))
    assert flat.c_left == pytest.approx(rho / (r * mu))
    assert flat.c_right == pytest.approx(-flat.c_left)


@pytest.mark.parametrize("frame", [0.0, 0.7])
def test_general_case_signs(frame):
    """c(f) = ρ cot φ / r, φ the angle of f from +y; c_left > 0 is the centre of the right turn."""
    tilt, half = 0.2, np.arctan(mu)
    contact = paper_contact(tilt, frame=frame)
    flat = flat_output(contact, PAPER)
    assert flat.c_left == pytest.approx(rho / np.tan(tilt + half) / r)
    assert flat.c_right == pytest.approx(rho / np.tan(tilt - half) / r)
    assert flat.c_right < 0 < flat.c_left
    assert flat.min_radius == pytest.approx(0.5 * (flat.c_left - flat.c_right))
    np.testing.assert_allclose(
        flat.flat_point, rotate(frame, [0.5 * (flat.c_left + flat.c_right), rho / r]), atol=1e-15
    )
    right_turn = surface_twist(contact, contact.force_edges().left)
    assert right_turn[2] < 0
    np.testing.assert_allclose(
        centre(contact, PAPER, contact.force_edges().left), rotate(frame, [flat.c_left, rho / r]), atol=1e-15
    )


def surface_twist(contact, force, surface=PAPER):
    return surface.matrix @ contact.wrench(force)


def test_proposition_1_duality():
    """The rotation centres lie on the line across contact → COF, a/(b r) beyond the COF (Eq. 15)."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        p = rotate(rng.uniform(-3, 3), [0.0, -rng.uniform(0.005, 0.05)])
        tilt = rng.uniform(-1.2, 1.2)
        contact = PointContact(p, rotate(tilt, -p), 0.8)
        if abs(np.tan(tilt)) < 0.79:  # it can steer
            axle = flat_output(contact, PAPER).flat_point
            assert float(axle @ -p / np.hypot(*p)) == pytest.approx(rho / np.hypot(*p))
        for force in in_cone(contact, rng, 5):
            c = centre(contact, PAPER, force)
            assert float(c @ -p / np.hypot(*p)) == pytest.approx(rho / np.hypot(*p))
            # Eq. 15, with the distance of the line of force (errata row 5).
            lever = cross(p, force) / np.hypot(*force)
            assert abs(lever) * np.hypot(*c) == pytest.approx(rho)


def test_rotation_centres_of_any_ellipsoid_lie_on_one_line():
    rng = np.random.default_rng(2)
    for _ in range(50):
        contact, surface, flat = random_push(rng)
        heading = rotate(flat.heading_offset, [1.0, 0.0])
        foot = flat.flat_point + flat.along * perpendicular(heading)
        assert float(foot @ perpendicular(heading)) == pytest.approx(
            0, abs=1e-12
        )  # foot of the perpendicular
        for force in in_cone(contact, rng, 5):
            c = centre(contact, surface, force)
            assert float((c - flat.flat_point) @ heading) == pytest.approx(0, abs=1e-9 * (1 + np.hypot(*c)))
        for force, abscissa in zip(contact.force_edges(), (flat.c_left, flat.c_right), strict=True):
            np.testing.assert_allclose(
                centre(contact, surface, force), foot - abscissa * perpendicular(heading), atol=1e-12
            )


def test_recover_on_the_papers_matrix_is_the_papers_equations():
    """Eqs. 24-28 and 31-33 in the push frame; Eq. 33 corrected (errata row 1), and the printed form fails."""
    contact = paper_contact(0.15)
    flat = flat_output(contact, PAPER)
    c = flat.along
    z, dz, ddz = np.array([0.3, -0.1]), np.array([0.02, 0.05]), np.array([-0.001, 0.004])
    pose, force = flat.recover(z, dz, ddz)
    v, turn = np.hypot(*dz), dz[0] * ddz[1] - ddz[0] * dz[1]
    theta = np.arctan2(-dz[0], dz[1])  # Eq. 31, errata row 6
    q = z - np.array([[dz[1], dz[0]], [-dz[0], dz[1]]]) @ [c, rho / r] / v  # Eq. 32
    np.testing.assert_allclose(pose, [*(z - rotate(theta, [c, rho / r])), theta], rtol=1e-12)
    np.testing.assert_allclose(q, pose[:2], rtol=1e-12)
    np.testing.assert_allclose(
        force, [turn / (b * r * v**2), (v**3 - c * turn) / (a * v**2)], rtol=1e-12
    )  # Eq. 33
    printed = (v**3 - c * v**2) / (a * v**2)
    assert abs(printed - force[1]) > 0.01 * force[1]
    np.testing.assert_allclose(flat.position(pose), z, atol=1e-15)  # Eq. 30
    # Judged without any of the formulas: the force must move the flat point the way it does move.
    V = PAPER.matrix @ [force[0], force[1], r * force[0]]
    velocity = rotate(theta, V[:2] + V[2] * perpendicular([c, rho / r]))
    np.testing.assert_allclose(velocity, dz, rtol=1e-12)
    V[:2] = PAPER.matrix[:2, :2] @ [force[0], printed]
    wrong = rotate(theta, V[:2] + V[2] * perpendicular([c, rho / r]))
    assert np.hypot(*(wrong - dz)) > 0.01 * v


def test_symmetric_recover_is_eqs_24_to_28():
    flat = flat_output(paper_contact(), PAPER)
    z, dz, ddz = np.array([0.1, 0.2]), np.array([-0.03, 0.01]), np.array([0.002, 0.003])
    (x, y, theta), (fx, fy) = flat.recover(z, dz, ddz)
    speed = np.hypot(*dz)
    assert theta == pytest.approx(np.arctan2(-dz[0], dz[1]))  # Eq. 24
    assert x == pytest.approx(z[0] - a * dz[0] / (b * r * speed))  # Eq. 25
    assert y == pytest.approx(z[1] - a * dz[1] / (b * r * speed))  # Eq. 26
    assert fx == pytest.approx((dz[0] * ddz[1] - dz[1] * ddz[0]) / (b * r * speed**2))  # Eq. 27
    assert fy == pytest.approx(speed / a)  # Eq. 28
    assert z[0] == pytest.approx(x - rho / r * np.sin(theta))  # Eq. 19
    assert z[1] == pytest.approx(y + rho / r * np.cos(theta))  # Eq. 20
    # Eqs. 7-9 with this force, then 16-18 and 23.
    dx = a * (fx * np.cos(theta) - fy * np.sin(theta))
    dy = a * (fx * np.sin(theta) + fy * np.cos(theta))
    omega = b * r * fx
    assert fx == pytest.approx((dx * np.cos(theta) + dy * np.sin(theta)) / a)  # Eq. 16
    assert fy == pytest.approx((-dx * np.sin(theta) + dy * np.cos(theta)) / a)  # Eq. 17
    assert -rho / r * omega + dx * np.cos(theta) + dy * np.sin(theta) == pytest.approx(0, abs=1e-15)  # Eq. 18
    assert dz[0] * np.cos(theta) + dz[1] * np.sin(theta) == pytest.approx(0, abs=1e-15)  # Eq. 23
    assert dx - rho / r * np.cos(theta) * omega == pytest.approx(dz[0])  # Eq. 21
    assert dy - rho / r * np.sin(theta) * omega == pytest.approx(dz[1])  # Eq. 22


def test_theorem_1_any_point_of_the_line():
    """Poses and forces come back from the flat motion alone, for any ellipsoid and any point of the line."""
    rng = np.random.default_rng(3)
    for _ in range(60):
        contact, surface, middle = random_push(rng)
        inside = middle.c_right + rng.uniform(0, 1) * (middle.c_left - middle.c_right)
        for along in (None, inside) + (0.0,) * (middle.c_right <= 0 <= middle.c_left):
            flat = flat_output(contact, surface, along)
            aside = (middle.along if along is None else along) - middle.along
            assert np.hypot(*(flat.flat_point - middle.flat_point)) == pytest.approx(abs(aside), abs=1e-12)
            poses, forces = rng.uniform(-2, 2, (8, 3)), in_cone(contact, rng, 8)
            found, found_forces = flat.recover(
                *flat_motion(contact, surface, flat, poses, forces, rng.normal(size=(8, 2)))
            )
            np.testing.assert_allclose(np.exp(1j * found[:, 2]), np.exp(1j * poses[:, 2]), atol=1e-8)
            np.testing.assert_allclose(found[:, :2], poses[:, :2], atol=1e-9)
            np.testing.assert_allclose(found_forces, push_frame(contact, forces), rtol=1e-6, atol=1e-9)


def push_frame(contact, forces):
    y = -contact.point / np.hypot(*contact.point)
    return np.stack([forces @ -perpendicular(y), forces @ y], axis=-1)


def test_points_outside_the_cone_centres_may_run_backward():
    """Beyond c_left it also runs backward; recover returns the forward twin, which the cone admits too."""
    rng = np.random.default_rng(4)
    backward = 0
    for _ in range(60):
        contact, surface, middle = random_push(rng)
        side = rng.choice([-1, 1])
        along = middle.along + side * rng.uniform(1.3, 3) * middle.min_radius
        flat = flat_output(contact, surface, along)
        assert flat.min_radius == pytest.approx(abs(along - middle.along) + middle.min_radius)
        poses, forces = rng.uniform(-2, 2, (8, 3)), in_cone(contact, rng, 8)
        z, dz, ddz = flat_motion(contact, surface, flat, poses, forces, np.zeros((8, 2)))
        found, found_forces = flat.recover(z, dz, ddz)
        forward = (
            np.einsum("ij,ij->i", dz, rotate(poses[:, 2] + flat.heading_offset, np.array([1.0, 0.0]))) > 0
        )
        backward += np.sum(~forward)
        np.testing.assert_allclose(found[forward, :2], poses[forward, :2], atol=1e-8)
        np.testing.assert_allclose(
            found_forces[forward], push_frame(contact, forces)[forward], rtol=1e-5, atol=1e-8
        )
        tilt = np.arctan2(*push_frame(contact, contact.normal[None])[0])  # of the normal, + to the right in P
        assert np.all(np.abs(np.arctan2(*found_forces.T) - tilt) <= contact.half_angle + 1e-9)
        np.testing.assert_allclose(flat.position(found), z, atol=1e-12)
    assert backward > 20


def test_one_sided_radii():
    contact = paper_contact(0.1)
    middle = flat_output(contact, PAPER)
    shifted = flat_output(contact, PAPER, along=middle.along + 0.3 * middle.min_radius)
    assert shifted.min_radius == pytest.approx(1.3 * middle.min_radius)
    shifted = flat_output(contact, PAPER, along=middle.along - 0.3 * middle.min_radius)
    assert shifted.min_radius == pytest.approx(1.3 * middle.min_radius)
    assert np.hypot(*(shifted.flat_point - middle.flat_point)) == pytest.approx(0.3 * middle.min_radius)


def test_integration_of_the_motion_is_a_dubins_path():
    """Eq. 12 with the edge forces moves the flat point on circles of the turning radius, forward."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        contact, surface, flat = random_push(rng)
        for force, sense in zip(contact.force_edges(), (-1, 1), strict=True):
            V = surface.matrix @ contact.wrench(force)
            times = np.linspace(0, 1.5 / abs(V[2]), 9)
            poses = compose(np.array([0.1, -0.2, 0.7]), exp(times[:, None] * V))
            z = flat.position(poses)
            heading = rotate(poses[0, 2] + flat.heading_offset, np.array([1.0, 0.0]))
            circle = z[0] + sense * flat.min_radius * perpendicular(heading)
            np.testing.assert_allclose(np.hypot(*(z - circle).T), flat.min_radius, rtol=1e-9)
            assert float((z[1] - z[0]) @ heading) > 0  # forward
        for along in np.linspace(flat.c_right, flat.c_left, 4):
            point = flat_output(contact, surface, float(along)).flat_point
            V = surface.matrix @ contact.wrench(contact.normal)
            velocity = V[:2] + V[2] * perpendicular(point)
            assert float(cross(rotate(flat.heading_offset, [1.0, 0.0]), velocity)) == pytest.approx(
                0, abs=1e-10 * np.hypot(*velocity)
            )


def test_numerical_integration_follows_the_flat_path():
    """A wave of forces in the cone, integrated by Runge-Kutta: recover returns its poses and forces."""
    rng = np.random.default_rng(6)
    contact, surface, flat = random_push(rng)
    half = contact.half_angle

    def force(t):
        return rotate(0.8 * half * np.sin(7 * t), contact.normal)

    def rate(t, q):
        V = surface.matrix @ contact.wrench(force(t))
        return np.array([*rotate(q[2], V[:2]), V[2]])

    h, q, t = 1e-3, np.array([0.0, 0.0, 0.3]), 0.0
    poses = [q]
    for _ in range(400):
        k1 = rate(t, q)
        k2 = rate(t + h / 2, q + h / 2 * k1)
        k3 = rate(t + h / 2, q + h / 2 * k2)
        k4 = rate(t + h, q + h * k3)
        q, t = q + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), t + h
        poses.append(q)
    poses = np.array(poses)
    z = flat.position(poses)
    dz = (z[:-4] - 8 * z[1:-3] + 8 * z[3:-1] - z[4:]) / (12 * h)
    ddz = (-z[:-4] + 16 * z[1:-3] - 30 * z[2:-2] + 16 * z[3:-1] - z[4:]) / (12 * h**2)
    found, forces = flat.recover(z[2:-2], dz, ddz)
    np.testing.assert_allclose(np.exp(1j * found[:, 2]), np.exp(1j * poses[2:-2, 2]), atol=1e-5)
    np.testing.assert_allclose(found[:, :2], poses[2:-2, :2], atol=1e-5 * np.max(np.hypot(*z.T)))
    times = h * np.arange(2, 399)
    expected = push_frame(contact, np.array([force(t) for t in times]))
    np.testing.assert_allclose(forces, expected, atol=1e-4)
    speed = np.hypot(*dz.T)
    assert np.max(np.abs(cross(dz, ddz)) / speed**3) * flat.min_radius <= 1 + 1e-3  # Eq. 29


def test_broadcasting():
    flat = flat_output(paper_contact(), PAPER)
    assert flat.position(np.zeros((4, 5, 3))).shape == (4, 5, 2)
    pose, force = flat.recover(np.zeros((4, 1, 2)), np.ones((5, 2)), np.zeros(2))
    assert pose.shape == (4, 5, 3)
    assert force.shape[-1] == 2
    with pytest.raises(InputError, match="rest"):
        flat.recover([0, 0], [0, 0], [1, 1])


@pytest.mark.parametrize("tilt", [0.5, -0.9])
def test_the_cone_must_strictly_contain_the_straight_force(tilt):
    """Errata row 9: refused by the angle that is missing, with the friction that would do."""
    with pytest.raises(NoDubinsReduction) as refusal:
        flat_output(paper_contact(tilt), PAPER)
    missing = np.rad2deg(abs(tilt) - np.arctan(mu))
    assert refusal.value.degrees == pytest.approx(missing)
    assert f"{missing:.1f}" in str(refusal.value)
    assert f"{np.tan(abs(tilt)):.2f}" in str(refusal.value)
    enough = np.tan(abs(tilt)) * 1.01
    assert flat_output(paper_contact(tilt, friction=enough), PAPER).min_radius > 0
    with pytest.raises(NoDubinsReduction):
        flat_output(paper_contact(tilt, friction=np.tan(abs(tilt))), PAPER)  # on the edge: R is infinite


def test_the_sign_test_of_full_ellipsoids():
    """Steering is refused exactly where ω(f_left) < 0 < ω(f_right) fails."""
    rng = np.random.default_rng(9)
    refused = 0
    for _ in range(200):
        surface = random_ellipsoid(rng)
        p = rotate(rng.uniform(-3, 3), [0.0, -0.02])
        contact = PointContact(p, rotate(rng.uniform(-0.8, 0.8), -p), 0.5)
        left, right = (surface_twist(contact, f, surface)[2] for f in contact.force_edges())
        if left < 0 < right:
            assert flat_output(contact, surface).c_right < flat_output(contact, surface).c_left
        else:
            refused += 1
            with pytest.raises(NoDubinsReduction):
                flat_output(contact, surface)
    assert 20 < refused < 180


def test_other_refusals():
    with pytest.raises(NoDubinsReduction, match="friction"):
        flat_output(paper_contact(friction=0.0), PAPER)
    for tiny in (0.0, 1e-18):
        with pytest.raises(NoDubinsReduction, match="centre of friction"):
            flat_output(PointContact([0.0, -tiny], [0.0, 1.0], mu), PAPER)
    hook = PointContact([0.0, r], [0.0, 1.0], mu, hook=True)
    with pytest.raises(NoDubinsReduction, match="other side") as refusal:
        flat_output(hook, PAPER)
    assert refusal.value.degrees == pytest.approx(180 - np.rad2deg(np.arctan(mu)))
    with pytest.raises(InputError, match="along"):
        flat_output(paper_contact(), PAPER, along=np.nan)


def test_stored_rear_axles_and_radii(data_folder):
    """The authors' stored rear axle (push frame) and turning radius, for every push of every plan graph."""
    files = sorted((data_folder / "plan_graph").glob("plan_graph_*.json"))
    assert files
    for file in files:
        for push in json.loads(file.read_text())["push_actions"]:
            contact = PointContact(push["contact_point"], push["inward_normal"], push["mu"])
            flat = flat_output(contact, Ellipsoid(np.diag([push["a"], push["a"], push["b"]])))
            assert flat.min_radius == pytest.approx(push["turning_radius"], rel=1e-6)
            axle = push_frame(contact, flat.flat_point[None])[0]
            np.testing.assert_allclose(axle, push["rear_axle_in_push_frame"], atol=5e-8)
