"""That sticking is the only motion, against all other modes of contact, enumerated table by table."""

import warnings

import numpy as np
import pytest

import flatpush as fp
from flatpush.contact import WrenchCone
from flatpush.contact.table_set import TableSet
from flatpush.contact.uniqueness import UNKNOWN, rivals_depth
from flatpush.friction.support import CollinearSupportWarning
from flatpush.geometry import perpendicular, velocity_at

SLIPS = 0.03 * np.tan(np.linspace(0, np.pi / 2, 3001)[1:-1])
# Tables of feet (x, y, load), the turning centre's height above the origin [m], friction and the places of the fingers:
# both fingers stick in that turn, or slip at some speed, or only one of them stays.
RIVALLED = [
    ([(1.336, 1.961, 0.302), (-0.124, -2.093, 0.506), (0.923, 1.923, 0.192)], -0.00629, 0.372, (0.002, 0.3)),
    ([(-0.103, -0.676, 0.512), (0.216, 2.596, 0.488)], 0.01987, 0.385, (0.002, 0.3)),
    ([(0.006, 1.045, 0.638), (0.248, 1.813, 0.362)], 0.01635, 1.506, (0.002, 0.02)),
    (
        [(0.448, -2.703, 0.133), (0.036, 0.61, 0.056), (0.003, -2.315, 0.38), (0.011, -0.49, 0.431)],
        -0.00528, 0.297, (0.005, 0.3),
    ),
]  # fmt: skip


def slipping(support, contacts, V, e):
    """Of the object while the hand slips along e at each of SLIPS: T, N and the forces of the fingers along n."""
    a, b = contacts
    speeds = abs(V[2]) * SLIPS[:, None]
    W = support.wrench(np.column_stack([V[:2] - speeds * e, np.full(len(speeds), V[2])]))
    left = perpendicular(a.normal)

    def pressed(finger, other):
        moment = W[:, 2] - (other.point[0] * W[:, 1] - other.point[1] * W[:, 0])
        return -moment / ((finger.point - other.point) @ left)

    return W[:, :2] @ e, W[:, :2] @ a.normal, pressed(a, b), pressed(b, a), W


def rivals(support, contacts, V):
    """Modes other than sticking that one table and the fingers allow."""
    n, found = contacts[0].normal, []
    for e in (perpendicular(n), -perpendicular(n)):
        T, N, f, g, _ = slipping(support, contacts, V, e)
        over = T - contacts[0].friction * N
        crossed = np.flatnonzero((over[:-1] < 0) != (over[1:] < 0))
        found += ["both slip"] * int(np.sum((f[crossed] >= 0) & (g[crossed] >= 0)))
    for i, finger in enumerate(contacts):
        other, u = contacts[1 - i].point, velocity_at(V, finger.point)
        alone = finger.motion(fp.Exact(support), u)
        if (velocity_at(alone.twist, other) - velocity_at(V, other)) @ n > 1e-7 * np.hypot(*u):
            found.append(f"{alone.mode} alone")
    return found


def corner(weights, share, order):
    """Loads at the ends of their ranges, most where the order says, of sum 1."""
    loads = (1 - share) * weights
    loads[order] += np.diff(np.minimum(np.cumsum(2 * share * weights[order]), share), prepend=0.0)
    return loads


def side(rng, feet):
    """Two fingers at a straight side behind some feet, and motions of theirs."""
    middle, half = rng.uniform(-0.003, 0.003), 0.5 * rng.uniform(0.012, 0.03)
    behind = float(np.min(feet.points[:, 1])) - rng.uniform(0.001, 0.01)
    mu = rng.uniform(0.15, 0.6)
    contacts = [fp.PointContact([middle + x, behind], [0, 1], mu) for x in (half, -half)]
    return contacts, np.column_stack([rng.uniform(-0.3, 0.3, 60), np.ones(60), rng.uniform(-60, 60, 60)])


def test_where_sticking_is_said_to_be_all_no_table_has_another_motion():
    """At corners of the loads and inside, places in the hand and frictions of random sets."""
    rng, said = np.random.default_rng(3), 0
    for _ in range(20):
        count, share, offset = int(rng.integers(3, 6)), rng.uniform(0, 0.4), rng.choice([0.0, 0.001])
        feet = TableSet.of(
            fp.Support.points(rng.normal(size=(count, 2)) * 0.02, rng.uniform(0.5, 1.5, count)), share
        )
        contacts, twists = side(rng, feet)
        held = feet.held(np.array([-1.0, 0.0]), offset)
        kept = np.min([place.margin(WrenchCone.of(contacts), twists) for place in held], axis=0) > 0
        for V in twists[kept][:2]:
            if rivals_depth(held, contacts, V[None]) <= 0:
                continue
            said += 1
            for _ in range(3):
                loads = corner(feet.weights, share * rng.choice([1.0, 0.5]), rng.permutation(count))
                table = fp.Support.points(
                    feet.points + rng.uniform(-offset, offset) * np.array([1.0, 0.0]), loads
                )
                firmer = rng.uniform(1.0, 1.5) * contacts[0].friction
                assert not rivals(table, [fp.PointContact(c.point, c.normal, firmer) for c in contacts], V)
    assert said > 20


@pytest.mark.parametrize(("feet", "height", "mu", "places"), RIVALLED)
def test_where_fingers_may_as_well_slip_sticking_is_not_said_to_be_all(feet, height, mu, places):
    x, y, w = np.array(feet).T
    points, w = 0.01 * np.stack([x, y], axis=1), w / w.sum()
    cof = w @ points
    contacts = [
        fp.PointContact(np.array([at, points[:, 1].min() - 0.002]) - cof, [0, 1], mu, hook=True)
        for at in places
    ]
    V = np.array([height - cof[1], cof[0], 1.0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CollinearSupportWarning)
        table = fp.Support.points(points - cof, w)
        tables = TableSet.of(table, 0.0)
        assert tables.margin(WrenchCone.of(contacts), V) > 0
        assert "both slip" in rivals(table, contacts, V)
    assert rivals_depth([tables], contacts, V[None]) < 0


def test_the_depth_of_one_table_is_that_of_its_rivals_one_by_one():
    """From above and within 0.01, by the wrenches of thousands of slips."""
    rng, gaps = np.random.default_rng(4), []
    for _ in range(15):
        feet = TableSet.of(fp.Support.points(rng.normal(size=(4, 2)) * 0.02), 0.0)
        contacts, twists = side(rng, feet)
        a, b = contacts
        lever = float(np.max(np.linalg.norm([a.point, b.point], axis=1)))
        V = twists[int(np.argmax(feet.margin(WrenchCone.of(contacts), twists)))]
        least = np.inf
        for e in ([1.0, 0.0], [-1.0, 0.0]):
            T, N, f, g, W = slipping(feet.support, contacts, V, np.array(e))
            size = np.linalg.norm(W / [1, 1, lever], axis=1)
            apart = abs(a.point[0] - b.point[0])
            pulls = [
                -force * apart / np.hypot(np.hypot(*other.point), lever) for force, other in ((f, b), (g, a))
            ]
            behind = np.minimum(np.maximum(*pulls), N)
            least = min(
                least, np.min(np.maximum((a.friction * N - T) / np.hypot(1, a.friction), behind) / size)
            )
        gaps.append(least - rivals_depth([feet], contacts, V[None]))
    assert np.min(gaps) > -1e-3
    assert np.max(gaps) < 0.01


def test_fingers_that_leave_or_push_round_sides_are_not_judged():
    feet = TableSet.of(fp.Support.points([(-0.02, -0.01), (0.02, -0.01), (0.0, 0.02)]), 0.1)
    contacts = [fp.PointContact([x, -0.02], [0, 1], 0.3) for x in (-0.009, 0.009)]
    assert rivals_depth([feet], contacts, [[0.0, 1.0, 0.0]]) > 0
    assert rivals_depth([feet], contacts, [[0.0, 0.005, 1.0]]) == UNKNOWN
    turned = [contacts[0], fp.PointContact([0.009, -0.02], [0.1, 1], 0.3)]
    assert rivals_depth([feet], turned, [[0.0, 1.0, 0.0]]) is None
