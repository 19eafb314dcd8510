"""Whether two fingers keep a motion, against arithmetic without rounding (fractions.Fraction) on 500 generated cases.

Contacts, friction, limit surfaces and wrenches are rational numbers, so that the faces of the composite cone and the
side of each on which a wrench lies are known exactly, on the boundary as well. Coulomb friction at feet has rational
wrenches where the distances from the rotation centre are rational (Pythagorean triples); where the centre is itself a
foot, the least free force that leads into the cone is compared with the foot's share by its square.
"""

import random
from fractions import Fraction as Q
from itertools import combinations

import numpy as np
import pytest

import flatpush as fp
from flatpush.contact import PointContact, WrenchCone
from flatpush.contact.wrench_cone import CLOSED

TRIPLES = [(3, 4, 5), (5, 12, 13), (8, 15, 17), (7, 24, 25), (20, 21, 29), (1, 0, 1), (0, 1, 1)]
Vector = tuple[Q, Q, Q]


def direction(rng: random.Random) -> tuple[Q, Q]:
    a, b, c = rng.choice(TRIPLES)
    if rng.random() < 0.5:
        a, b = b, a
    return rng.choice((1, -1)) * Q(a, c), rng.choice((1, -1)) * Q(b, c)


def small(rng: random.Random, size: int = 20) -> Q:
    return Q(rng.randint(-size, size), rng.randint(1, 6))


class Pair:
    """Two contacts on one side of an object, or on a bent one, with rational cones."""

    def __init__(self, rng: random.Random) -> None:
        self.mu = Q(rng.randint(1, 9), 10)
        n = direction(rng)
        t = (-n[1], n[0])
        depth, middle, half = (
            Q(rng.randint(4, 30), 10),
            Q(rng.randint(-10, 10), 10),
            Q(rng.randint(2, 12), 10),
        )
        self.points = [
            tuple(-depth * n[k] + (middle + side * half) * t[k] for k in (0, 1)) for side in (1, -1)
        ]
        self.normals = [n, n]
        if rng.random() < 0.3:  # normals that differ a little: those of a curved side
            c, s = Q(40, 41), rng.choice((1, -1)) * Q(9, 41)
            self.normals = [n, (c * n[0] - s * n[1], s * n[0] + c * n[1])]

    @property
    def rays(self) -> list[Vector]:
        found = []
        for (px, py), (nx, ny) in zip(self.points, self.normals, strict=True):
            for side in (1, -1):
                fx, fy = nx - side * self.mu * ny, ny + side * self.mu * nx
                found.append((fx, fy, px * fy - py * fx))
        return found

    @property
    def contacts(self) -> list[PointContact]:
        return [
            PointContact([float(x) for x in p], [float(x) for x in n], float(self.mu), hook=True)
            for p, n in zip(self.points, self.normals, strict=True)
        ]


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b) -> Q:
    return sum((x * y for x, y in zip(a, b, strict=True)), Q(0))


def faces(rays: list[Vector]) -> list[Vector]:
    found = []
    for a, b in combinations(rays, 2):
        n = cross(a, b)
        for sign in (1, -1):
            face = tuple(sign * x for x in n)
            if any(face) and all(dot(face, ray) >= 0 for ray in rays):
                found.append(face)
    assert len(found) >= 3
    return found


def holds(pair: Pair, wrench: Vector) -> bool:
    return all(dot(face, wrench) >= 0 for face in faces(pair.rays))


def holds_with_free(pair: Pair, wrench: Vector, point: tuple[Q, Q], share: Q) -> bool:
    """Whether wrench + J_pᵀ g is in the cone for some |g| ≤ share: the least |g|² in a polygon of half-planes."""
    x, y = point
    planes = []
    for n in faces(pair.rays):
        planes.append(((n[0] - y * n[2], n[1] + x * n[2]), dot(n, wrench)))
    tries = [(Q(0), Q(0))]
    for a, b in planes:
        size = a[0] ** 2 + a[1] ** 2
        if size:
            tries.append((-b * a[0] / size, -b * a[1] / size))
    for (a, b), (c, d) in combinations(planes, 2):
        det = a[0] * c[1] - a[1] * c[0]
        if det:
            tries.append(((-b * c[1] + d * a[1]) / det, (-d * a[0] + b * c[0]) / det))
    feasible = [
        g[0] ** 2 + g[1] ** 2 for g in tries if all(a[0] * g[0] + a[1] * g[1] + b >= 0 for a, b in planes)
    ]
    return bool(feasible) and min(feasible) <= share**2


def some_wrench(rng: random.Random, pair: Pair) -> Vector:
    """A wrench inside, outside or exactly on the boundary of the cone."""
    rays = pair.rays
    kind = rng.choice(("any", "inside", "face", "ray", "beyond"))
    if kind == "any":
        return (small(rng), small(rng), small(rng))
    if kind == "ray":
        return rng.choice(rays)
    if kind == "face":
        a, b = rng.sample(rays, 2)
        s, t = Q(rng.randint(0, 5), 5), Q(rng.randint(1, 5), 3)
        return tuple(s * x + t * y for x, y in zip(a, b, strict=True))
    weights = [Q(rng.randint(0, 6), 7) for _ in rays]
    if kind == "beyond":
        weights[rng.randrange(4)] -= Q(1, 3)
    total = tuple(sum((w * ray[k] for w, ray in zip(weights, rays, strict=True)), Q(0)) for k in range(3))
    return total if any(total) else rays[0]


def ellipsoid_case(rng: random.Random):
    pair, F = Pair(rng), (Q(0),) * 3
    while not any(F):
        F = some_wrench(rng, pair)
    B = [[Q(rng.randint(-3, 3), 4) for _ in range(3)] for _ in range(3)]
    A = [[dot(B[i], B[j]) + (i == j) for j in range(3)] for i in range(3)]
    V = [dot(row, F) for row in A]
    surface = fp.Ellipsoid([[float(x) for x in row] for row in A])
    return pair, surface, V, holds(pair, F)


def quartic_case(rng: random.Random):
    """H = (x² + y² + k z²)² + x⁴ + z⁴ with k of a few values: convex, and its gradient is rational."""
    pair, F = Pair(rng), (Q(0),) * 3
    while not any(F):
        F = some_wrench(rng, pair)
    k = Q(rng.randint(1, 8), 4)
    x, y, z = F
    r = x * x + y * y + k * z * z
    V = [4 * x * r + 4 * x**3, 4 * y * r, 4 * k * z * r + 4 * z**3]
    q = float(k)
    surface = fp.Quartic([2, 1, q * q + 1, 0, 0, 0, 0, 0, 0, 2, 2 * q, 2 * q, 0, 0, 0])
    return pair, surface, V, holds(pair, F)


def feet_case(rng: random.Random, resting: bool):
    """Feet at rational distances from a rotation centre; if resting, the centre is a foot as well."""
    pair = Pair(rng)
    while True:
        arms = []
        for _ in range(rng.randint(3, 5)):
            e, length = direction(rng), Q(rng.randint(2, 30), 10)
            arms.append((e, length))
        shares = [Q(rng.randint(1, 5)) for _ in arms]
        rest = Q(rng.randint(1, 6)) if resting else Q(0)
        total = sum(shares, rest)
        shares, rest = [s / total for s in shares], rest / total
        # With the centre of rotation c, feet c + ℓ e: the centre of friction at the origin gives c.
        c = tuple(
            -sum((s * le * e[k] for s, (e, le) in zip(shares, arms, strict=True)), Q(0)) for k in (0, 1)
        )
        places = [(c[0] + le * e[0], c[1] + le * e[1]) for e, le in arms]
        if len({*places, c}) == len(places) + 1 and np.linalg.matrix_rank(np.array(places, float)) == 2:
            break
    sense = rng.choice((1, -1))
    force = [Q(0), Q(0)]
    torque = Q(0)
    for share, (e, _), p in zip(shares, arms, places, strict=True):
        f = (-sense * share * e[1], sense * share * e[0])
        force = [force[0] + f[0], force[1] + f[1]]
        torque += p[0] * f[1] - p[1] * f[0]
    F = (force[0], force[1], torque)
    xy = [*places, *([c] if resting else [])]
    weights = [*shares, *([rest] if resting else [])]
    support = fp.Support.points(np.array(xy, dtype=float), np.array(weights, dtype=float))
    V = [sense * c[1], -sense * c[0], Q(sense)]
    wanted = rng.random() < 0.5  # most fingers would not be where the motion needs them
    for _ in range(400):
        answer = holds_with_free(pair, F, c, rest) if resting else holds(pair, F)
        if answer == wanted:
            break
        pair = Pair(rng)
    return pair, fp.Exact(support.centred()), V, answer


CASES = [
    *[("ellipsoid", ellipsoid_case)] * 200,
    *[("quartic", quartic_case)] * 50,
    *[("feet", lambda rng: feet_case(rng, False))] * 150,
    *[("resting foot", lambda rng: feet_case(rng, True))] * 100,
]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ellipsoid", "quartic", "feet", "resting foot"])
def test_membership_agrees_with_exact_arithmetic(kind):
    assert len(CASES) == 500
    rng = random.Random(f"two fingers, {kind}")
    kept = []
    for make in (make for name, make in CASES if name == kind):
        pair, surface, twist, answer = make(rng)
        V = np.array([float(v) for v in twist])
        assert fp.two_point_sticks(pair.contacts, surface, V) == answer
        cone = WrenchCone.of(pair.contacts)
        assert (cone.depths(surface.wrench_set(V))[1] >= -CLOSED) == answer
        kept.append(answer)
    # Both answers occur often enough that agreement means something.
    assert 0.1 < np.mean(kept) < 0.9
