"""Whether two fingers keep an object for every table of a set: a proof over all loads near the nominal ones.

A twist V moves the support point p with the unit velocity û(p). The table's wrench W = ∫ (û, p × û) dw is linear in
the loads w, and a face n of the fingers' composite cone is kept when n · W = ∫ g dw ≥ 0, g(p) = n · (û, p × û). Over
all loads with |w - w̄| ≤ δ w̄ at every point and the same sum, the least value is

    n · W̄ - δ min_m ∫ |g - m| dw̄,

a fractional knapsack whose dual is attained at the weighted median of g. At a point under the rotation centre û is any
vector of length at most one, and g its least value there.

Spread pressure is divided into patches. Within a patch g leaves its value at the middle by no more than a bound that is
added to |g - m|, so that what is called kept is proved, and the answer is on the safe side by the size of the patches.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import is_finite
from ..errors import InputError, NoDubinsReduction
from ..friction.patches import patches as divided
from ..friction.support import Support
from ..geometry import perpendicular, rotate
from ..geometry.pose import Array
from .point_contact import PointContact
from .wrench_cone import WrenchCone

# A rotation centre within this part of the support's radius from a foot is under it.
UNDER = 1e-9
# Families of motions: directions beside the nominal straight one [rad], and where they are held, by the distance of the
# nominal turning centres ahead of the centre of friction.
DIRECTIONS = np.deg2rad(np.linspace(-30.0, 30.0, 21))
AHEAD = np.array([0.0, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5])
# Turns are looked at between these radii, by the support's, in so many steps.
WIDE, TIGHT, STEPS = 100.0, 0.1, 40
# Points of the pressure on which families are compared, and how many of the best are then proved.
SKETCH, TRIED = 64, 6
# Patches that a spread pressure is divided into.
PATCHES = 400
# Normals of two contacts on one straight side differ by less [rad, and of the side's length].
PARALLEL = 1e-9


@dataclass(frozen=True, eq=False)
class WorstTable:
    """The table of a set that comes nearest to letting the object slip.

    Attributes:
        margin: depth of its wrench in the composite cone (see WrenchCone.depth); negative where it lies outside.
        loads: of the feet or patches, in parts of the whole, shape (n,).
        face: inward unit normal of the face that it comes nearest to, torque by the cone's lever, shape (3,).
    """

    margin: float
    loads: Array
    face: Array


@dataclass(frozen=True, eq=False)
class TableSet:
    """All tables whose loads differ from the nominal ones by at most a share at every point.

    A load here is pressure times the table's friction: a share of 0.2 allows for feet that bear a fifth more or less,
    or for friction that varies by as much from place to place, or for both together up to that product.

    Attributes:
        support: nominal, about its centre of friction.
        share: δ, at least 0 and less than 1.
        points, weights: feet or middles of patches, about the nominal centre of friction, shapes (n, 2) [m] and (n,).
        reach: greatest distance from the middle of each patch to a point of it, shape (n,) [m]; 0 for feet.

    >>> from flatpush.contact import PointContact
    >>> feet = Support.points([(-0.02, -0.01), (0.02, -0.01), (0.0, 0.02)])
    >>> contacts = [PointContact([x, -0.02], [0, 1], 0.3) for x in (-0.009, 0.009)]
    >>> tables = TableSet.of(feet, 0.2)
    >>> bool(tables.margin(WrenchCone.of(contacts), [0.0, 1.0, 0.0]) > 0)
    True
    """

    support: Support
    share: float
    points: Array
    weights: Array
    reach: Array

    @classmethod
    def of(cls, support: Support, share: float, patches: int = PATCHES) -> "TableSet":
        """The set about a support.

        Args:
            patches: about so many are made of a pressure that is spread over an area or along a line.

        Raises:
            InputError: for a share that is not at least 0 and less than 1.
        """
        if not (is_finite(share) and 0 <= share < 1):
            raise InputError(
                "the share by which loads may differ is at least 0 and less than 1", key="loads", value=share
            )
        centred = support.centred()
        return cls(centred, float(share), *divided(centred.pressure, patches))

    @cached_property
    def radius(self) -> float:
        """Of the support [m]."""
        return self.support.radius

    def margin(self, cone: WrenchCone, twist: ArrayLike) -> Array:
        """The least depth (see WrenchCone.depth) of the wrenches of a twist over all tables of the set, shape (...).

        Args:
            cone: of the fingers, about the nominal centre of friction.
            twist: about the same point, shape (..., 3).
        """
        V = np.asarray(twist, dtype=float)
        return self._least(cone, V.reshape(-1, 3))[0].reshape(V.shape[:-1])

    def worst(self, cone: WrenchCone, twist: ArrayLike) -> WorstTable:
        """The table that brings one twist (3,) nearest to slipping."""
        V = np.asarray(twist, dtype=float).reshape(1, 3)
        margin, face = self._least(cone, V)
        n = cone.faces[face[0]]
        g, _ = self._powers(cone, V, n[None])
        change = _extreme(g[0, 0], self.weights)
        return WorstTable(float(margin[0]), self.weights * (1 - self.share * change), n)

    def _least(self, cone: WrenchCone, V: Array) -> tuple[Array, Array]:
        """Least depths and the faces they are nearest to, both (m,)."""
        g, slack = self._powers(cone, V, cone.faces)
        if np.any(self.reach > 0):
            W = self.support.wrench(V) / [1.0, 1.0, cone.lever]
            nominal = W @ cone.faces.T
        else:
            nominal = g @ self.weights
            W = self._wrenches(cone, V)
        middle = _weighted_median(g, self.weights)
        spread = (np.abs(g - middle[..., None]) + slack) @ self.weights
        # By the nominal wrench's size, as a depth is.
        size = np.maximum(np.linalg.norm(W, axis=1), 1e-300)
        heights = (nominal - self.share * spread) / size[:, None]
        faces = np.argmin(heights, axis=1)
        return np.take_along_axis(heights, faces[:, None], axis=1)[:, 0], faces

    def _wrenches(self, cone: WrenchCone, V: Array) -> Array:
        unit, _ = self._velocities(V)
        x, y = self.points.T
        torque = x * unit[..., 1] - y * unit[..., 0]
        return np.stack(
            [unit[..., 0] @ self.weights, unit[..., 1] @ self.weights, torque @ self.weights / cone.lever], 1
        )

    def _velocities(self, V: Array) -> tuple[Array, Array]:
        """Unit velocities (m, n, 2) of the points, zero where one rests, and speeds over |ω| (m, n); inf if ω = 0."""
        x, y = self.points.T
        v = np.stack([V[:, :1] - V[:, 2:] * y, V[:, 1:2] + V[:, 2:] * x], axis=-1)
        speed = np.linalg.norm(v, axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = np.where(V[:, 2:] == 0, np.inf, speed / np.abs(V[:, 2:]))
            unit = np.where((distance > UNDER * self.radius)[..., None], v / speed[..., None], 0.0)
        return unit, distance

    def _powers(self, cone: WrenchCone, V: Array, faces: Array) -> tuple[Array, Array]:
        """g of each twist, face and point, shape (m, k, n), and by how much g may differ within each patch."""
        unit, distance = self._velocities(V)
        x, y = self.points.T / cone.lever
        # g = a · û with a = n_xy + n_τ perp(p), perp(p) = (-y, x).
        a = faces[:, None, :2] + faces[:, None, 2:] * np.stack([-y, x], axis=1)
        g = np.einsum("mni,kni->mkn", unit, a)
        resting = ~np.any(unit != 0, axis=-1)
        if np.any(resting):
            g = np.where(resting[:, None], -np.linalg.norm(a, axis=-1), g)
        if not np.any(self.reach > 0):
            return g, np.zeros(1)
        # û turns by at most asin(h / d) within h of p; elsewhere, about a centre at d < h, it may be anything.
        with np.errstate(invalid="ignore"):
            turn = np.where(distance > self.reach, np.arcsin(np.minimum(self.reach / distance, 1.0)), np.pi)
        chord = 2 * np.sin(0.5 * turn)
        slack = (
            chord[:, None] * np.linalg.norm(a, axis=-1) + np.abs(faces[:, None, 2]) * self.reach / cone.lever
        )
        return g, slack


def _weighted_median(values: Array, weights: Array) -> Array:
    """Of values (..., n) with weights (n,), shape (...)."""
    order = np.argsort(values, axis=-1, kind="stable")
    total = np.cumsum(weights[order], axis=-1)
    at = np.argmax(total >= 0.5 * total[..., -1:], axis=-1)
    index = np.take_along_axis(order, at[..., None], axis=-1)
    return np.take_along_axis(values, index, axis=-1)[..., 0]


def _extreme(g: Array, weights: Array) -> Array:
    """By how much, in parts of δ, the worst loads fall short of the nominal ones: in [-1, 1], of mean 0, shape (n,)."""
    order = np.argsort(-g, kind="stable")
    before = np.cumsum(weights[order]) - weights[order]
    half = 0.5 * float(np.sum(weights))
    # The greatest g get the least load, the rest the most; the point in the middle takes what makes the sum right.
    change = np.where(before + weights[order] <= half, 1.0, np.where(before >= half, -1.0, 0.0))
    split = (before < half) & (before + weights[order] > half)
    change[split] = (2 * (half - before[split]) - weights[order][split]) / weights[order][split]
    found = np.empty(len(g))
    found[order] = change
    return found


def shifted(contacts: Sequence[PointContact], offset: float) -> list[list[PointContact]]:
    """Two contacts in the extreme places that they may have along a straight side, an offset [m] either way.

    Raises:
        InputError: for an offset on a side that is not straight.
    """
    if offset == 0:
        return [list(contacts)]
    a, b = contacts
    if float(a.normal @ b.normal) < 1 - PARALLEL or abs(float((b.point - a.point) @ a.normal)) > PARALLEL:
        raise InputError("an offset of the grasp needs two fingers on one straight side", value=offset)
    along = perpendicular(a.normal)
    return [[replace(c, point=c.point + s * offset * along) for c in (a, b)] for s in (-1.0, 0.0, 1.0)]


def set_twists(tables: TableSet, cones: Sequence[WrenchCone], nominal: ArrayLike) -> Array:
    """A left turn, a straight motion and a right turn that every table of a set allows, turning as tightly as it can.

    Motions are looked at in families: a point ahead of the centre of friction, at shares of the distance of the nominal
    turning centres, moves in one direction while the turn per length grows from nothing to the first motion that some
    table does not allow. Of all families the two are taken whose turning centres are nearest to each other, and the
    straight motion that is square to the line between them if every table allows it, else the nearest that is.

    Args:
        cones: of the fingers in every place that they may have, about the nominal centre of friction; all must keep a
            motion.
        nominal: left, straight and right on the nominal table, shape (3, 3); see cone_twists.

    Returns:
        Twists about the nominal centre of friction, shape (3, 3); the turns have ω = 1 and -1, the other unit speed.

    Raises:
        NoDubinsReduction: if the tables have no straight motion, or no turn to either side, in common.
    """

    a, straight, b = np.asarray(nominal, dtype=float)
    straight = straight[:2] / np.hypot(*straight[:2])
    ahead = 0.5 * float(perpendicular(a[:2] / a[2] + b[:2] / b[2]) @ straight)
    ways = rotate(DIRECTIONS, straight)
    ways = ways[_kept(tables, cones, np.column_stack([ways, np.zeros(len(ways))]))]
    if not len(ways):
        raise NoDubinsReduction(_nothing(tables, "push straight without slipping"))
    families = np.tile(ways, (len(AHEAD), 1))
    leans = np.repeat(-ahead * AHEAD, len(ways))[:, None] * perpendicular(straight)
    # Which families turn tightest is seen on few points; how tightly they may is then proved.
    sketch = (
        tables
        if len(tables.points) <= SKETCH
        else replace(TableSet.of(tables.support, tables.share, SKETCH), reach=np.zeros(1))
    )
    found = []
    for sense in (1.0, -1.0):
        _, tight = _tightest(sketch, cones, families, leans, sense)
        first = np.argsort(-tight, kind="stable")[:TRIED]
        centres, tight = _tightest(tables, cones, families[first], leans[first], sense)
        found.append(centres[tight > 0])
    lefts, rights = found
    if not len(lefts) or not len(rights):
        raise NoDubinsReduction(_nothing(tables, "turn the object both ways"))
    best = int(np.argmin(np.linalg.norm(lefts[:, None] - rights[None], axis=2)))
    left, right = lefts[best // len(rights)], rights[best % len(rights)]
    square = -perpendicular(left - right)
    square = square / np.hypot(*square)
    if not _kept(tables, cones, np.array([*square, 0.0])):
        square = ways[int(np.argmax(ways @ square))]
    return np.stack([[*-perpendicular(left), 1.0], [*square, 0.0], [*perpendicular(right), -1.0]])


def _kept(tables: TableSet, cones: Sequence[WrenchCone], twists: Array) -> Array:
    return np.asarray(np.min([tables.margin(cone, twists) for cone in cones], axis=0) >= 0)


def _tightest(
    tables: TableSet, cones: Sequence[WrenchCone], families: Array, leans: Array, sense: float
) -> tuple[Array, Array]:
    """Centres (n, 2) of the tightest turns of families that are kept from straight on, and turns per length (n,)."""
    turns = 1.0 / (tables.radius * WIDE * (TIGHT / WIDE) ** np.linspace(0.0, 1.0, STEPS))

    def motions(turn: Array) -> Array:
        return np.concatenate([families + turn[..., None] * leans, turn[..., None]], axis=-1)

    good = _kept(tables, cones, motions(sense * np.repeat(turns[:, None], len(families), axis=1)))
    count = np.where(good.all(axis=0), len(turns), np.argmin(good, axis=0))
    low = np.where(count > 0, turns[np.maximum(count - 1, 0)], 0.0)
    high = np.where(count < len(turns), turns[np.minimum(count, len(turns) - 1)], low)
    for _ in range(8):
        middle = 0.5 * (low + high)
        fine = np.logical_and(_kept(tables, cones, motions(sense * middle)), low > 0)
        low, high = np.where(fine, middle, low), np.where(fine, high, middle)
    with np.errstate(divide="ignore", invalid="ignore"):
        V = motions(sense * low)
        return np.asarray(perpendicular(V[:, :2]) / V[:, 2:]), low


def _nothing(tables: TableSet, what: str) -> str:
    return (
        f"with loads that differ by up to {100 * tables.share:g} % the fingers cannot {what} on every table; a wider"
        " spacing, more friction or better known loads would help"
    )
