"""docs/errata.md: what is computed holds, and what is printed does not. Rows 1 and 7 stand with their equations, in
test_flat_output.py and test_local_model.py."""

import csv
import re
from dataclasses import replace

import numpy as np
import pytest

import flatpush as fp
from flatpush.contact import PointContact
from flatpush.control.laws.formulas import AFTER, AxisGains, Bounds, FlatPose, FlatTarget, linearised
from flatpush.control.laws.gains import Gains
from flatpush.errors import NoDubinsReduction
from flatpush.experiments import fig3, fig4
from flatpush.friction import Ellipsoid
from flatpush.geometry import rotate
from flatpush.planning import Planner
from flatpush.steering import flat_output

HEADING, SPEED, DT = 0.4, 0.02, 1e-6
BOUNDS = Bounds(
    30.0, 30.0, 1e-3, 1.0
)  # turn per length to either side [1/m], least and most flat speed [m/s]


def acceleration(
    target: FlatTarget, gains: AxisGains, speed: float = SPEED
) -> tuple[np.ndarray, float, bool]:
    """z̈ of the flat point at the origin in a tick of the law, how far its turn was scaled, whether s was bounded."""
    after, _, omega, scale, bounded = linearised(
        FlatPose(0.0, 0.0, HEADING), speed, target, gains, BOUNDS, DT, AFTER
    )
    h = rotate(HEADING, [1.0, 0.0])
    return (after * rotate(omega * DT, h) - speed * h) / DT, scale, bounded


def test_row_2_the_acceleration_of_the_reference_is_fed_forward_not_its_velocity() -> None:
    z_d, dz_d, ddz_d = np.array([1e-4, -2e-4]), np.array([0.018, 0.009]), np.array([0.002, 0.001])
    kp, kd = np.array([2.0, 0.5]), np.array([0.1, 0.05])
    found, scale, bounded = acceleration(FlatTarget(*z_d, *dz_d, *ddz_d), AxisGains(*kp, *kd))
    assert scale == 1.0
    assert not bounded
    feedback = -kp * (0.0 - z_d) - kd * (SPEED * rotate(HEADING, [1.0, 0.0]) - dz_d)
    np.testing.assert_allclose(found, ddz_d + feedback, atol=1e-7)
    assert np.hypot(*(found - (dz_d + feedback))) > 0.5 * SPEED  # as printed


A, B, R, MU = 1.3, 2400.0, 0.021, 0.45  # of the paper's matrix and contact [m]
MATRIX = Ellipsoid(np.diag([A, A, B]))
BELOW = PointContact([0.0, -R], [0.0, 1.0], MU)


def test_rows_3_to_5_rotation_centre_unit_of_length_and_distance_of_the_line_of_force() -> None:
    force = np.array([0.3, 1.0])
    V = MATRIX.twist(BELOW.wrench(force))

    def velocity(point: np.ndarray) -> float:
        return float(np.hypot(V[0] - V[2] * point[1], V[1] + V[2] * point[0]))

    centre, printed = np.array([-V[1], V[0]]) / V[2], V[:2] / V[2]
    assert velocity(centre) == pytest.approx(0, abs=1e-12)
    assert velocity(printed) > 0.5 * np.hypot(*V[:2])
    # In millimetres b is a millionth of itself: a length grows a thousandfold.
    in_mm = flat_output(PointContact([0.0, -1000 * R], [0.0, 1.0], MU), Ellipsoid(np.diag([A, A, B / 1e6])))
    assert in_mm.min_radius == pytest.approx(1000 * flat_output(BELOW, MATRIX).min_radius)
    assert np.sqrt(A / (B / 1e6)) == pytest.approx(1000 * np.sqrt(A / B))
    assert pytest.approx(1000 * A / B) != A / (B / 1e6)  # as printed
    lever = abs(R * force[0]) / np.hypot(*force)
    assert lever * np.hypot(*centre) == pytest.approx(A / B)
    assert R * np.hypot(*centre) > 2 * A / B  # as printed


def test_row_6_the_heading_backwards_is_not_that_forwards() -> None:
    flat = flat_output(BELOW, MATRIX)
    for dz in np.array([[0.01, 0.02], [0.01, -0.02], [-0.01, -0.02]]):
        (_, _, theta), _ = flat.recover(np.zeros(2), dz, np.zeros(2))
        np.testing.assert_allclose(rotate(theta, [0.0, 1.0]), dz / np.hypot(*dz), atol=1e-12)
        printed = np.arctan(-dz[0] / dz[1])
        assert (np.cos(printed - theta) > 0) == (dz[1] > 0)
    with pytest.raises(ValueError, match="zero"):
        flat.recover(np.zeros(2), np.zeros(2), np.zeros(2))


def test_row_8_the_cone_stands_on_the_normal_of_the_contact() -> None:
    leaning = PointContact([0.0, -R], rotate(0.3, [0.0, 1.0]), MU)
    for angle, sticks in ((0.3 + 0.3, True), (-0.3, False)):  # of the force, from the direction to the COF
        force = rotate(angle, [0.0, 1.0])
        V = MATRIX.twist(leaning.wrench(force))
        u = np.array([V[0] + V[2] * R, V[1]])  # of the contact
        assert (leaning.motion(MATRIX, u).mode == "sticking") is sticks
        assert (abs(force[0]) <= MU * force[1]) is not sticks  # as printed


def test_row_9_a_straight_force_outside_the_cone_makes_no_car() -> None:
    """Of the printed car, with its axle at (c_l + c_r)/2 and |c_l - c_r|/2 as its radius, no motion sticks."""
    for tilt, sticks in ((0.2, True), (np.arctan(MU) + 0.1, False)):
        contact = PointContact([0.0, -R], rotate(tilt, [0.0, 1.0]), MU)
        V_l, V_r = (MATRIX.twist(contact.wrench(f)) for f in contact.force_edges())
        c_l, c_r = -V_l[1] / V_l[2], -V_r[1] / V_r[2]
        axle, radius = 0.5 * (c_l + c_r), 0.5 * abs(c_l - c_r)
        for omega in np.array([-0.95, -0.4, 0.0, 0.4, 0.95]) / radius:  # forward at a speed of 1
            V = np.array([omega * A / B / R, 1 - omega * axle, omega])
            u = np.array([V[0] + V[2] * R, V[1]])  # of the contact
            assert (contact.motion(MATRIX, u).mode == "sticking") is sticks
        if sticks:
            assert flat_output(contact, MATRIX).min_radius == pytest.approx(radius)
            continue
        assert V_l[2] * V_r[2] > 0  # every force turns it the same way
        with pytest.raises(NoDubinsReduction) as refusal:
            flat_output(contact, MATRIX)
        assert refusal.value.degrees == pytest.approx(np.rad2deg(0.1))


# Start of a square that the shortest word of the flat point (RLR) takes longer to bring to its goal than RSR does.
ROW_10 = (0.06, -0.06, float(np.deg2rad(-80)))


def flat_length(plan: fp.Plan) -> float:
    """Of the way of the flat point [m], from the plan's arcs."""
    car = Planner(plan.scene).usable[0].car
    x, y = 0.5 * (car.left_centre + car.right_centre)
    V = np.array([arc.twist for push in plan.pushes for arc in push.arcs])
    durations = np.array([arc.duration for push in plan.pushes for arc in push.arcs])
    return float(durations @ np.hypot(V[:, 0] - V[:, 2] * y, V[:, 1] + V[:, 2] * x))


def test_row_10_the_shortest_path_of_the_flat_point_is_not_the_fastest_push() -> None:
    """A fingertip goes √(1 + (L/R)²) times as far as the flat point in a turn, L = r + ρ/r, and has a speed."""
    given = replace(fig3.scenes()[0], start=ROW_10)
    shortest, fastest = (
        fp.plan(replace(given, planning=replace(given.planning, cost=cost))) for cost in ("flat", "time")
    )
    assert fp.verify(shortest).ok
    assert fp.verify(fastest).ok
    assert shortest.cost == pytest.approx(flat_length(shortest), rel=1e-6)
    assert flat_length(fastest) > 1.02 * shortest.cost
    assert (shortest.pushes[0].word, fastest.pushes[0].word) == ("RLR", "RSR")
    assert fastest.duration < 0.95 * shortest.duration


def test_row_11_the_law_is_not_linear_at_rest_nor_outside_the_cone() -> None:
    gains = AxisGains(4.0, 4.0, 4.0, 4.0)
    ahead = rotate(HEADING, [0.0, 1e-4])
    wanted = 4.0 * ahead + 4.0 * SPEED * rotate(HEADING, [1.0, 0.0])
    target = FlatTarget(*ahead, *(2 * SPEED * rotate(HEADING, [1.0, 0.0])), 0.0, 0.0)
    found, scale, bounded = acceleration(target, gains)
    np.testing.assert_allclose(found, wanted, rtol=1e-4)
    _, _, bounded = acceleration(target, gains, speed=0.0)
    assert bounded  # Eq. 45 divides by the flat speed
    far = FlatTarget(*(1e3 * ahead), *(SPEED * rotate(HEADING, [1.0, 0.0])), 0.0, 0.0)
    found, scale, _ = acceleration(far, gains)
    assert scale < 0.5
    assert abs(found @ rotate(HEADING, [0.0, 1.0])) < 0.5 * 4e3 * np.hypot(*ahead)


def test_row_12_the_printed_gains_leave_millimetres_after_30_seconds() -> None:
    left = []
    for kp, kd in zip(*fig4.PAPER_GAINS, strict=True):
        poles = np.roots([1.0, kd, kp])
        assert np.all(np.abs(poles.imag) > 10 * np.abs(poles.real))
        left.append(np.exp(30.0 * poles.real.max()))
    np.testing.assert_allclose(left, [0.22, 0.47], atol=0.005)
    error = fig4.tracked(Gains(*map(np.array, fig4.PAPER_GAINS)), fig4.NOMINAL)
    assert 0.2 * np.hypot(1.0, 2.5) < 1e3 * fig4.flat_error(error) < 0.5 * np.hypot(1.0, 2.5)
    assert 1e3 * fig4.flat_error(error) > 100 * np.hypot(0.0034, 0.0012)  # as printed, in millimetres


def test_row_13_signed_errors_cancel(data_folder) -> None:
    """Over the logs that are there; the paper's figure is over all 61."""
    with open(data_folder / "robot_exp_logs" / "summary_runs.csv", newline="", encoding="utf-8") as file:
        errors = np.array(
            [
                [float(row[f"err_{name}"]) for name in ("x_mm", "y_mm", "theta_deg")]
                for row in csv.DictReader(file)
            ]
        )
    assert len(errors) > 30
    assert np.hypot(*errors[:, :2].mean(axis=0)) < 0.85 * np.hypot(*errors[:, :2].T).mean()
    assert abs(errors[:, 2].mean()) < 0.5 * np.abs(errors[:, 2]).mean()


def test_row_14_two_signs_of_the_caption_of_fig_6(data_folder) -> None:
    with open(
        data_folder / "robot_exp_logs" / "compare_with_paper.csv", newline="", encoding="utf-8"
    ) as file:
        rows = [
            row for row in csv.DictReader(file) if row["object"] == "bigrect_3pts" and row["subset"] == "all"
        ]
    found = {
        (row["start_id"], row["component"]): (float(row["mean"]), float(row["paper_mean"])) for row in rows
    }
    for start, component in (("0", "theta_deg"), ("2", "x_mm")):
        logged, printed = found[start, component]
        assert printed == pytest.approx(-logged, abs=0.006)


def test_row_15_a_contact_with_c_needs_the_flat_speed_as_the_compensator_s_state() -> None:
    a, b, r = 1.3, 2400.0, 0.021
    surface = Ellipsoid(np.diag([a, a, b]))
    flat = flat_output(PointContact([0.0, -r], rotate(0.15, [0.0, 1.0]), 0.45), surface)
    c, s, omega = flat.along, 0.02, 0.3
    assert abs(c) > 1e-3
    force_x = omega / (b * r)

    def speed(force_y: float) -> float:
        """Of the flat point along +y, by V = A Jᵀ f."""
        V = surface.matrix @ [force_x, force_y, r * force_x]
        return float(V[1] + V[2] * c)

    assert speed((s - c * omega) / a) == pytest.approx(s, rel=1e-12)
    assert abs(speed(s / a) - s) > 0.05 * s  # Eqs. 43-45 as they stand, ζ = s/a


def test_row_16_only_the_ratio_of_a_and_b_moves_anything() -> None:
    f, u = np.array([0.3, 1.0]), np.array([0.002, 0.02])
    F, steps = BELOW.wrench(f), 1e-3 * np.diag([1.0, 1.0, R])
    gradient = (MATRIX.value(F + steps) - MATRIX.value(F - steps)) / (2 * np.diag(steps))
    np.testing.assert_allclose(gradient[:2], 2 * A * f, rtol=1e-9)  # Eq. 1, with k = 1, of H = FᵀAF
    np.testing.assert_allclose(MATRIX.twist(F)[:2], A * f)  # Eqs. 4 and 5
    J = np.array([[1.0, 0.0, R], [0.0, 1.0, 0.0]])
    force = np.linalg.solve(J @ MATRIX.matrix @ J.T, u)  # Eq. 13
    for scale in (0.5, 1e3):
        scaled = Ellipsoid(scale * MATRIX.matrix)
        np.testing.assert_allclose(np.linalg.solve(J @ scaled.matrix @ J.T, u), force / scale)
        assert flat_output(BELOW, scaled).min_radius == pytest.approx(flat_output(BELOW, MATRIX).min_radius)
        motion = BELOW.motion(scaled, u)
        assert motion.mode == "sticking"
        np.testing.assert_allclose(motion.twist, BELOW.motion(MATRIX, u).twist, rtol=1e-12)


def test_every_row_that_is_cited_is_there() -> None:
    from pathlib import Path

    root = Path(__file__).parents[2]
    table = (root / "docs" / "errata.md").read_text(encoding="utf-8")
    rows = {int(number) for number in re.findall(r"^\| (\d+) \|", table, re.M)}
    cited: set[int] = set()
    for path in (*root.glob("src/**/*.py"), *root.glob("tests/**/*.py"), *root.glob("docs/*.md")):
        for listed in re.findall(
            r"[Ee]rrata(?:\.md\)?)?,? (?:rows? )?((?:\d+(?:, | and )?)+)", path.read_text("utf-8")
        ):
            cited |= {int(number) for number in re.findall(r"\d+", listed)}
    assert cited >= {1, 2, 11, 12, 15}
    assert cited <= rows == set(range(1, 17))
