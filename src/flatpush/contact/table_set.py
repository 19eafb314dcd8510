"""Whether two fingers keep an object for every table of a set: a proof over all loads near the nominal ones.

A twist V moves the support point p with the unit velocity û(p). The table's wrench W = ∫ (û, p × û) dw is linear in
the loads w, and a face n of the fingers' composite cone is kept when n · W = ∫ g dw ≥ 0, g(p) = n · (û, p × û). Over
all loads with |w - w̄| ≤ δ w̄ at every point and the same sum, the least value is

    n · W̄ - δ min_m ∫ |g - m| dw̄,

a fractional knapsack whose dual is attained at the weighted median of g. At a point under the rotation centre û is any
vector of length at most one, and g its least value there.

Spread pressure is divided into patches. Where g - m changes its sign within a patch, g leaves its value at the centroid
by no more than a bound of first order, which is added to |g - m|. Elsewhere ∫ |g - m| dw̄ is the patch's load times
|g - m| at the centroid but for a term of second order, since the linear one vanishes. So what is called kept is proved,
and the answer is on the safe side by the square of the patches' size.

An object that lies beside its place in the hand is turned about the same centres of the hand by contacts at the same
places of it: its support alone lies elsewhere. The margins at three places along the side, less what ∫ g dw can fall
short of the line between two of them, hold at all places between.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import is_finite
from ..errors import InputError
from ..friction.patches import patches as divided
from ..friction.support import Support
from ..geometry import perpendicular
from ..geometry.pose import Array
from .point_contact import PointContact
from .wrench_cone import WrenchCone

# A rotation centre within this part of the support's radius from a foot is under it.
UNDER = 1e-9
# Places in the hand are so far apart at most, by the support's radius.
STRIDE = 0.1
# Patches that a spread pressure is divided into.
PATCHES = 200
# Normals of two contacts on one straight side differ by less [rad, and of the side's length].
PARALLEL = 1e-9
# A unit velocity seen from a point at a distance ρ that moves along a line has |û''| ≤ SWING / ρ².
SWING = 2 / np.sqrt(3)


@dataclass(frozen=True, eq=False)
class WorstTable:
    """The table of a set that comes nearest to letting the object slip.

    Attributes:
        margin: as TableSet.margin of the twist.
        loads: of the feet or patches, in parts of the whole, shape (n,).
        face: inward unit normal of the face that it comes nearest to, torque by the cone's lever, shape (3,).
        depth: of its wrench under that face, by the nominal wrench's size; for feet in their place the margin itself.
    """

    margin: float
    loads: Array
    face: Array
    depth: float


@dataclass(frozen=True, eq=False)
class TableSet:
    """All tables whose loads differ from the nominal ones by at most a share at every point.

    A load here is pressure times the table's friction: a share of 0.2 allows for feet that bear a fifth more or less,
    or for friction that varies by as much from place to place, or for both together up to that product.

    Attributes:
        support: nominal, about its centre of friction.
        share: δ, at least 0 and less than 1.
        points, weights: feet or centroids of patches, about the nominal centre of friction, shapes (n, 2) [m] and (n,).
        reach, along: of the patches, as friction.patches.Patches has them, shapes (n,) [m] and (n, 2).
        step: from its place in the hand to a neighbour's; margins hold for all places between [m].
        aside: margins of a turn hold for turns about all points within it of that one's centre [m].

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
    along: Array
    step: float = 0.0
    aside: float = 0.0

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

    def held(self, along: Array, offset: float) -> tuple["TableSet", ...]:
        """The set at places in the hand up to an offset [m] to either side along a unit vector (2,), its own first."""
        if offset == 0:
            return (self,)
        steps = math.ceil(offset / (STRIDE * self.radius))
        ways = [0.0] + [sign * (offset * k / steps) for k in range(1, steps + 1) for sign in (-1.0, 1.0)]
        return tuple(self.placed(way * along, offset / steps) for way in ways)

    def placed(self, way: Array, step: float = 0.0) -> "TableSet":
        """The set moved in the hand by a way (2,) [m], for all places up to a step on [m]."""
        return replace(self, support=self.support.translated(way), points=self.points + way, step=step)

    def loaded(self, cone: WrenchCone, twist: ArrayLike, face: Array, loads: Array) -> float:
        """The depth under a face (3,) of the wrench of given loads (n,), by the nominal wrench's size."""
        V = np.asarray(twist, dtype=float).reshape(1, 3)
        g, *_ = self._powers(cone.lever, V, face[None])
        _, _, size, _ = self._ranges(cone.faces, cone.lever, V)
        return float(g[0, 0] @ loads / size[0])

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
        heights = self.heights(cone.faces, cone.lever, V.reshape(-1, 3))
        return np.asarray(np.min(heights, axis=1).reshape(V.shape[:-1]))

    def worst(self, cone: WrenchCone, twist: ArrayLike) -> WorstTable:
        """The table that brings one twist (3,) nearest to slipping."""
        V = np.asarray(twist, dtype=float).reshape(1, 3)
        heights = self.heights(cone.faces, cone.lever, V)[0]
        face = int(np.argmin(heights))
        n = cone.faces[face]
        g, *_ = self._powers(cone.lever, V, n[None])
        loads = self.weights * (1 - self.share * _extreme(g[0, 0], self.weights))
        return WorstTable(float(heights[face]), loads, n, self.loaded(cone, V, n, loads))

    def most(self, values: Array, first: Array, second: Array) -> Array:
        """The greatest ∫ v dw over the loads of the set, of v at each point (..., n), shape (...); no less of patches.

        Args:
            first, second: bounds of |v - v(p)| within a patch, and of its mean over it.
        """
        nominal = (values + np.minimum(first, second)) @ self.weights
        return np.asarray(nominal + self.share * self._spread(values, first, second))

    def largest(self, cone: WrenchCone, twist: ArrayLike) -> Array:
        """The largest share, at most 1, by which loads may differ so that twists are kept, shape (...).

        The least height over a face is nominal - δ spread with a spread that does not depend on δ. 0 where a twist
        is not kept on the nominal table.
        """
        V = np.asarray(twist, dtype=float)
        nominal, spread, *_ = self._ranges(cone.faces, cone.lever, V.reshape(-1, 3))
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(spread > nominal, nominal / spread, 1.0)
        return np.clip(np.min(share, axis=1), 0.0, 1.0).reshape(V.shape[:-1])

    def heights(self, faces: Array, lever: float, V: Array) -> Array:
        """The least n · W over all tables for each of twists (m, 3) and normals (k, 3), by the nominal wrench's size.

        Args:
            lever: torques are divided by it [m].

        Returns:
            shape (m, k).
        """
        nominal, spread, size, _ = self._ranges(faces, lever, V)
        return np.asarray((nominal - self.share * spread) / size[:, None])

    def heights_between(self, faces: Array, lever: float, V: Array) -> Array:
        """As heights, of all twists from each of V (m, 3) to the next while the turning centre moves straight.

        Along its way û leaves the line between its two values by at most the chord between them, and, |û''| being at
        most SWING/ρ², by SWING/8 of the square of the way over the distance ρ of the centre. What is near it may resist
        in any direction: its power is taken as the least, where that is more.

        Returns:
            shape (m - 1, k).
        """
        nominal, spread, size, (g, first, _, unit, distance, arms) = self._ranges(faces, lever, V)
        room = self.reach + self.step
        with np.errstate(divide="ignore", invalid="ignore"):
            centres = perpendicular(V[:, :2]) / V[:, 2:]
            way = np.linalg.norm(np.diff(centres, axis=0), axis=1)[:, None]
            near = np.maximum(0.5 * (distance[:-1] + distance[1:] - way) - room, UNDER * self.radius)
            second = np.where(np.isfinite(way), SWING / 8 * (way / near) ** 2, np.inf)
            seen = np.where(np.isfinite(way), 2 * np.arcsin(np.minimum(0.5 * way / near, 1.0)), np.pi)
            around = np.where(distance > room, np.arcsin(np.minimum(room / distance, 1.0)), np.pi)
        turn = np.arccos(np.clip(np.sum(unit[:-1] * unit[1:], axis=-1), -1.0, 1.0))
        turn = np.minimum(seen, turn + around[:-1] + around[1:])
        chord = np.fmin(2 * np.sin(0.5 * np.minimum(turn, np.pi)), second)[:, None]
        arms = arms + np.abs(faces[:, 2:]) / lever * room
        fall = g + first + arms  # to the least power
        fall = np.where(
            chord * arms * 2 < fall[:-1] + fall[1:], chord * arms, np.stack([fall[:-1], fall[1:]])
        )
        off = (1 + self.share) * fall @ self.weights
        least = nominal - self.share * spread
        ends = (np.stack([least[:-1], least[1:]]) - off) / np.stack([size[:-1], size[1:]])[..., None]
        return np.asarray(np.min(ends, axis=0))

    def _ranges(self, faces: Array, lever: float, V: Array) -> tuple[Array, Array, Array, "_Powers"]:
        """n · W̄ and min ∫ |g - m| dw̄ for each face, shapes (m, k), the sizes of the nominal wrenches (m,), and g.

        Of places in the hand the first is less, and the second more, by what lies between.
        """
        powers = self._powers(lever, V, faces)
        g, first, second, unit, distance, arms = powers
        if np.any(self.reach > 0):
            W = self.support.wrench(V) / [1.0, 1.0, lever]
            nominal = W @ faces.T
        else:
            nominal = g @ self.weights
            W = self._wrenches(lever, unit)
        spread = self._spread(g, first, second)
        # By the nominal wrench's size, as a depth is.
        size = np.maximum(np.linalg.norm(W, axis=1), 1e-300)
        if self.step > 0:
            between = self._between(lever, distance, faces, arms) @ self.weights
            nominal, spread = nominal - between, spread + between
        if self.aside > 0:
            beside = self._beside(lever, faces, powers) @ self.weights
            nominal, spread = nominal - beside, spread + beside
        return nominal, spread, size, powers

    def _spread(self, g: Array, first: Array, second: Array) -> Array:
        """min ∫ |g - m| dw̄ over m, shape (...), of g at each point (..., n); of patches, not less than that."""
        off = np.abs(g - _weighted_median(g, self.weights)[..., None])
        return np.asarray((off + np.where(off > first, np.minimum(first, second), first)) @ self.weights)

    def _between(self, lever: float, distance: Array, faces: Array, arms: Array) -> Array:
        """By how much g may fall short of the line between its values here and a step aside, shape (m, k, n).

        Along a line g = a · û has |g''| ≤ |a| |û''| + 2 |a'| |û'|; where a centre is near, its range tells more.
        """
        slope = np.abs(faces[:, 2:]) / lever
        far = arms + slope * (self.reach + self.step)
        away = distance - self.reach
        near = 1 / np.maximum(away - self.step, UNDER * self.radius)[:, None]
        second = self.step**2 / 8 * (far * SWING * near**2 + 2 * slope * near)
        turn = np.arcsin(np.clip(self.step / np.maximum(away, UNDER * self.radius), 0.0, 1.0))
        chord = np.where(away > self.step, 2 * np.sin(0.5 * turn), 2.0)[:, None]
        return np.minimum(second, 2 * np.minimum(far, far * chord + slope * self.step))

    def _beside(self, lever: float, faces: Array, powers: "_Powers") -> Array:
        """By how much g may fall while the turning centre is up to `aside` from its place, shape (m, k, n).

        û turns by at most asin(aside / ρ) at a distance ρ from that; nearer, it may be anything.
        """
        room = self.reach + self.step
        away = np.maximum(powers.distance - room, 0.0)
        far = powers.arms + np.abs(faces[:, 2:]) / lever * room
        turn = np.arcsin(np.minimum(self.aside / np.maximum(away, self.aside), 1.0))
        chord = np.where(away > self.aside, 2 * np.sin(0.5 * turn), 2.0)[:, None]
        return np.minimum(chord * far, powers.g + powers.first + far)

    def _wrenches(self, lever: float, unit: Array) -> Array:
        x, y = self.points.T
        torque = x * unit[..., 1] - y * unit[..., 0]
        return np.stack(
            [unit[..., 0] @ self.weights, unit[..., 1] @ self.weights, torque @ self.weights / lever], 1
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

    def _powers(self, lever: float, V: Array, faces: Array) -> "_Powers":
        unit, distance = self._velocities(V)
        # g = a · û, a = n_xy + n_τ perp(p)
        a = faces[:, None, :2] + faces[:, None, 2:] * perpendicular(self.points) / lever
        size = np.linalg.norm(a, axis=-1)
        g = np.einsum("mni,kni->mkn", unit, a)
        resting = ~np.any(unit != 0, axis=-1)
        if np.any(resting):
            g = np.where(resting[:, None], -size, g)
        if not np.any(self.reach > 0):
            return _Powers(g, np.zeros(1), np.zeros(1), unit, distance, size)
        h, slope = self.reach, np.abs(faces[:, 2:]) / lever  # |∇a|
        # û turns by at most asin(h / d) within h of p; elsewhere, about a centre at d < h, it may be anything.
        with np.errstate(invalid="ignore", divide="ignore"):
            turn = np.where(distance > h, np.arcsin(np.minimum(h / distance, 1.0)), np.pi)
            # At a distance ρ from the centre |∇û| = 1/ρ and |∇²û| ≤ 2/(√3 ρ²): û(φ) has unit derivatives, φ has
            # |∇φ| = 1/ρ and, being harmonic, ∇²φ with the eigenvalues ±1/ρ². A patch keeps ρ ≥ d - h.
            near = 1 / np.maximum(distance - h, UNDER * self.radius)[:, None]
            second = 0.5 * h**2 * ((size + slope * h) * SWING * near**2 + 2 * slope * near)
            # ∇g = (ω/v) (a · perp(û)) û - n_τ perp(û), and along a straight piece only its part that way counts.
            swing = (
                np.sign(V[:, 2:])[:, None]
                * np.einsum("mni,kni->mkn", perpendicular(unit), a)
                / distance[:, None]
            )
        lean = -faces[:, 2:] / lever
        u, v = (np.einsum("mni,ni->mn", w, self.along)[:, None] for w in (unit, perpendicular(unit)))
        straight = np.any(self.along != 0, axis=1)
        rate = np.where(straight, np.abs(swing * u + lean * v), np.hypot(swing, lean))
        chord = 2 * np.sin(0.5 * turn)[:, None]
        return _Powers(g, np.fmin(chord * size + slope * h, rate * h + second), second, unit, distance, size)


class _Powers(NamedTuple):
    """g of each twist, face and point, shape (m, k, n), and what it comes from.

    Attributes:
        first, second: bounds of |g - g(p)| at every point of a patch, p its centroid, and of the mean of g - g(p) over
            it, shapes as g's; of feet 0.
        unit, distance: of each twist and point, see TableSet._velocities.
        arms: |a| of g = a · û, shape (k, n).
    """

    g: Array
    first: Array
    second: Array
    unit: Array
    distance: Array
    arms: Array


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


def side_along(contacts: Sequence[PointContact], offset: float) -> Array:
    """The unit vector along the straight side that two contacts may be off along by an offset [m], shape (2,).

    Raises:
        InputError: for an offset on a side that is not straight.
    """
    if offset != 0 and not is_straight(contacts):
        raise InputError(
            f"an offset of the grasp, here {1000 * offset:g} mm, needs two fingers on one straight side",
            hint="Leave the offset out, or push on a straight side.",
        )
    return np.asarray(perpendicular(contacts[0].normal))


def is_straight(contacts: Sequence[PointContact]) -> bool:
    """Whether two contacts touch one straight side."""
    a, b = contacts
    return (
        float(a.normal @ b.normal) >= 1 - PARALLEL
        and abs(float((b.point - a.point) @ a.normal)) <= PARALLEL
        and float(np.linalg.norm(b.point - a.point)) > PARALLEL
    )
