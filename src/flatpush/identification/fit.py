"""The table learned from motion alone: where the object presses, and the friction of the finger.

The finger pushes at a point, so the table's wrench has no moment about it: an equation linear in the loads, from which
the search starts (methods: [Zhou2017] Eq. 1 under an unknown force). Then loads and friction are moved so that short
stretches, rolled out in the plant from their smoothed poses, end where they were seen to end.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import FlatpushError
from ..geometry import cross, log, perpendicular, relative, rotate, velocity_at
from ..geometry.pose import Array
from ..problem import Object
from ..simulation.plant import Plant
from ..simulation.plant.codes import LEFT, RIGHT
from .motion import Frames, Motion, Seen, Stretches, look
from .pressure import AbstractPressure, Density, FreeFeet, KnownFeet
from .sensitivity import Sensitivity, Way, sensitivity

# Feet that may stand anywhere are sought from so many down to so few. Their places have many minima: a fit starts from
# the linear equations' loads, gathered from so many draws, and from those of the fit with a foot more that come nearest
# when one is left out or two are put together.
MOST_FEET, LEAST_FEET = 7, 3
DRAWN, DRAWN_AGAIN, WITHOUT = 3, 1, 2
# The search ends where a number of feet, at its best, is so much less likely than the best (2 log of the ratio): more
# than two feet that differ by one in number have done in 25 random tables, or a start more that was drawn.
UNLIKELIER = 80.0
# Loads on known feet may be better known than SD_FOOT: statics tells those of three feet. How well is taken from the
# data, of these standard deviations of their logarithms; of one that seems so much less likely there is no search.
SD_FEET, HOPELESS = (0.1, 0.2), 6.0
# It narrows what is said of the uncertainty only where it is so much likelier: 2 log of the ratio, "positive" evidence
# [Kass and Raftery, Bayes factors, 1995].
LIKELIER = 2.0
# Stretches whose error is beyond this many standard deviations count little (Cauchy).
SOFT = 2.5
# Standard deviation of log μ before anything is seen; a friction above this is not told from sticking for ever.
SD_FRICTION, MOST_FRICTION = 1.0, 3.0
# A contact slides where it slips by more than this part of the finger's way.
SLIPS = 0.1
_ROUNDS, _STEPS, _REWEIGHTED = 4, 15, 15
_MEDIAN2 = 1.386  # of χ² with two degrees of freedom: an end has two, as the finger stays at the outline


@dataclass(frozen=True, eq=False)
class MotionFit:
    """What motion says of the table.

    Attributes:
        thing: the object with the fitted support and friction.
        pressure: the family. numbers: its free numbers, shape (p,).
        covariance: of the numbers and of log μ, shape (p + 1, p + 1).
        scatter: of the ends of stretches, its ratio to what noise of the poses gives; about 1 where the model is right.
        stretches: how many were used. sliding: the share of their ways on which the finger slid.
        evidence: the number -2 log of the data's probability under the family, up to a constant (Laplace).
        seen: what the recordings hold.
        others: fits of other families to the same motion, which explain it less well.
    """

    thing: Object
    pressure: AbstractPressure
    numbers: Array
    covariance: Array
    scatter: float
    stretches: int
    sliding: float
    evidence: float
    seen: Seen
    others: tuple["MotionFit", ...] = ()

    def at(self, change: Array) -> Object:
        """The object with other numbers.

        Args:
            change: from the fitted ones, of the loads' p numbers and of the logarithm of the friction, shape (p + 1,).
        """
        support = self.pressure.support(self.numbers + change[:-1])
        friction = float(self.thing.friction * np.exp(change[-1]))
        return Object(self.thing.outline, support, friction, None, self.thing.name)

    def drawn(self, number: int, rng: np.random.Generator) -> list[Object]:
        """Objects that explain the motion as well: of all families as likely as they are, of each within its spread.

        Args:
            number: how many. rng: what they are drawn with.
        """
        fits = (self, *self.others)
        odds = np.exp([0.5 * (self.evidence - fit.evidence) for fit in fits])
        chosen = [fits[k] for k in rng.choice(len(fits), size=number, p=odds / odds.sum())]
        return [
            fit.at(rng.multivariate_normal(np.zeros(len(fit.covariance)), fit.covariance)) for fit in chosen
        ]

    @property
    def friction_sd(self) -> float:
        """Standard deviation of the friction coefficient."""
        return float(self.thing.friction * np.sqrt(self.covariance[-1, -1]))


def fit_motion(
    motions: Sequence[Motion], thing: Object, tip_radius: float, *, known_support: bool = True
) -> MotionFit:
    """Loads and friction from recordings of one finger's pushes.

    Args:
        motions: of object and fingertip.
        thing: outline, and the friction and loads that are expected. Where it stands on feet their places are kept.
        tip_radius: of the finger [m].
        known_support: False: also where the object stands on feet, these are not believed.

    Raises:
        InputError: as motion.look.
    """
    return fit_seen(look(motions, thing.outline, tip_radius), thing, tip_radius, known_support=known_support)


def fit_seen(seen: Seen, thing: Object, tip_radius: float, *, known_support: bool = True) -> MotionFit:
    """The same from what recordings hold, as motion.look or motion.seen_of gives it."""
    if known_support and len(thing.support.feet[0]):
        return _known_feet(seen, thing, tip_radius)
    density = Density(thing.outline)
    fits = [_fitted(density, density.mean, seen, thing, tip_radius)]
    fits += _feet_anywhere(seen, thing, tip_radius, density.at(density.mean).places, fits[0].evidence)
    fits.sort(key=lambda fit: fit.evidence)
    return replace(fits[0], others=tuple(fits[1:]))


def _feet_anywhere(
    seen: Seen, thing: Object, tip_radius: float, around: Array, evidence: float
) -> list[MotionFit]:
    """The likeliest fit of each number of feet that may stand anywhere.

    Args:
        around: places where something may press (k, 2). evidence: of the likeliest fit so far.
    """
    loads = _linear(seen.frames, around, np.full(len(around), 1 / len(around)))
    rng = np.random.default_rng(0)  # the same feet for the same motion
    best: list[MotionFit] = []
    for count in range(MOST_FEET, LEAST_FEET - 1, -1):
        family = FreeFeet(thing.outline, count)
        starts = [_gathered(rng, around, loads, count) for _ in range(DRAWN_AGAIN if best else DRAWN)]
        if best:
            starts += _with_one_fewer(best[-1], seen, tip_radius)[:WITHOUT]
        fits = [_fitted(family, family.numbers(*start), seen, thing, tip_radius) for start in starts]
        best.append(min(fits, key=lambda fit: fit.evidence))
        evidence = min(evidence, best[-1].evidence)
        if best[-1].evidence > evidence + UNLIKELIER:
            break
    return best


def _with_one_fewer(fit: MotionFit, seen: Seen, tip_radius: float) -> list[tuple[Array, Array]]:
    """Places and loads in which a foot of a fit is left out, or two are put together, those that explain most first."""
    places, loads = fit.pressure.at(fit.numbers)[:2]
    found = []
    for i in range(len(loads)):
        found.append((np.delete(places, i, axis=0), np.delete(loads, i) / (1 - loads[i])))
        for j in range(i):
            both, shares = places.copy(), loads.copy()
            shares[j] += shares[i]
            both[j] += loads[i] / shares[j] * (places[i] - places[j])
            found.append((np.delete(both, i, axis=0), np.delete(shares, i)))
    family = FreeFeet(fit.thing.outline, len(loads) - 1)
    search = _Search(family, seen, fit.thing, tip_radius, float(np.log(fit.thing.friction)))

    def cost(start: tuple[Array, Array]) -> float:
        at = search.roll(np.append(family.numbers(*start), np.log(fit.thing.friction)))
        return search._cost(at, at.covariance, 1.0)

    return sorted(found, key=cost)


def _known_feet(seen: Seen, thing: Object, tip_radius: float) -> MotionFit:
    """Loads on the feet of the object, held to what is expected of them as much as the data bear out."""
    places, expected = thing.support.feet
    wide = _fitted(KnownFeet(places, expected), None, seen, thing, tip_radius)
    fits = [wide]
    for sd in SD_FEET:
        if _evidence(wide, sd) < wide.evidence + HOPELESS:
            fits.append(_fitted(KnownFeet(places, expected, sd), None, seen, thing, tip_radius))
    best = min(fits, key=lambda fit: fit.evidence)
    likelier = wide.evidence - best.evidence > LIKELIER
    return best if likelier else replace(best, covariance=wide.covariance)


def _evidence(fit: MotionFit, sd: float) -> float:
    """The evidence that a fit on known feet would have if the logarithms of the loads were expected within sd, were the
    errors linear in the numbers."""
    H = np.linalg.inv(fit.covariance)
    wide, narrow = fit.pressure.precision, np.full(len(fit.numbers), sd**-2)
    pull = fit.numbers - fit.pressure.mean
    change = np.diag(np.append(narrow - wide, 0.0))
    other = H + change
    moved = change @ np.append(pull, 0.0)  # the gradient that the narrower prior adds where the fit is
    best = float(pull @ ((narrow - wide) * pull) - moved @ np.linalg.solve(other, moved))
    spread = float(np.linalg.slogdet(other)[1] - np.linalg.slogdet(H)[1] - np.sum(np.log(narrow / wide)))
    return fit.evidence + best + spread


def information(fit: MotionFit, stretches: Stretches, tip_radius: float) -> Array:
    """What stretches that end as the fit predicts would tell of its numbers and log μ, (p + 1, p + 1)."""
    seen = replace(fit.seen, stretches=stretches)
    search = _Search(fit.pressure, seen, fit.thing, tip_radius, float(np.log(fit.thing.friction)))
    at = search.roll(np.append(fit.numbers, np.log(fit.thing.friction)))
    return search.normal(at, at.covariance, fit.scatter**2)[0] - np.diag(search.precision)


def _linear(frames: Frames, places: Array, expected: Array) -> Array:
    """Loads without moment about the contacts: Σ wᵢ (rᵢ - p) × uᵢ = 0, nonnegative, reweighted."""
    from scipy.optimize import nnls

    rows = np.flatnonzero(~frames.corner)
    rows = rows[:: max(1, len(rows) // 400)]
    V, p = frames.twists[rows], frames.points[rows]
    a = velocity_at(V[:, None], places[None])
    unit = a / np.maximum(np.linalg.norm(a, axis=2, keepdims=True), 1e-9)
    size = float(np.max(np.ptp(places, axis=0)))
    A = cross(places[None] - p[:, None], unit) / size
    weights = np.ones(len(A))
    k = len(places)
    root = np.sqrt(len(A))
    pull = 0.02 * root / np.sqrt(k) * expected.mean()
    whole = np.full((1, k), 100.0 * root)
    goal = np.concatenate([np.zeros(len(A)), [100.0 * root], np.full(k, pull)])
    for _ in range(_REWEIGHTED):
        w, _ = nnls(np.vstack([A * weights[:, None], whole, pull * np.diag(1 / expected)]), goal)
        left = np.abs(A @ w)
        weights = 1 / np.sqrt(np.maximum(left, 0.1 * np.median(left) + 1e-6))
        weights /= np.median(weights)
    return np.asarray(w / w.sum())


def _gathered(rng: np.random.Generator, places: Array, loads: Array, count: int) -> tuple[Array, Array]:
    """So many feet that stand for loads at places, each for those next to it: begun where loads are, far apart."""
    weights = loads + 0.1 / len(loads)
    chosen = [int(rng.choice(len(weights), p=weights / weights.sum()))]
    for _ in range(count - 1):
        away = np.min(np.linalg.norm(places[:, None] - places[chosen][None], axis=2), axis=1) ** 2 * weights
        chosen.append(int(rng.choice(len(away), p=away / away.sum())))
    feet, weights = places[chosen], loads + 1e-4 / len(loads)
    owner = np.argmin(np.linalg.norm(places[:, None] - feet[None], axis=2), axis=1)
    feet = np.array(
        [np.average(places[owner == i], axis=0, weights=weights[owner == i]) for i in range(count)]
    )
    shares = np.maximum([weights[owner == i].sum() for i in range(count)], 0.02)
    return feet, shares / shares.sum()


def _first_friction(frames: Frames, places: Array, loads: Array, expected: float) -> float:
    """The direction of the contact force while it slides; else what is expected, but not below what stuck."""
    good = ~frames.corner
    V, n = frames.twists[good], frames.normals[good]
    a = velocity_at(V[:, None], places[None])
    unit = a / np.maximum(np.linalg.norm(a, axis=2, keepdims=True), 1e-9)
    force = np.einsum("k,nkd->nd", loads, unit)
    t = perpendicular(n)
    ratio = np.sum(t * force, axis=1) / np.maximum(np.sum(n * force, axis=1), 1e-6)
    slip = np.sum(t * (frames.slides[good] - velocity_at(V, frames.points[good])), axis=1)
    slides = (np.abs(slip) > SLIPS) & (np.sign(slip) == np.sign(ratio))
    if np.count_nonzero(slides) >= 10:
        return float(np.clip(np.median(np.abs(ratio[slides])), 0.02, MOST_FRICTION))
    return float(np.clip(max(expected, np.percentile(np.abs(ratio), 90)), 0.02, MOST_FRICTION))


def _fitted(
    family: AbstractPressure, start: Array | None, seen: Seen, thing: Object, tip_radius: float
) -> MotionFit:
    spread = family.at(family.mean if start is None else start)
    if start is None:  # loads on known feet come from the linear equations
        loads = _linear(seen.frames, spread.places, spread.loads)
        start = np.log(np.maximum(loads, 0.01))
        spread = family.at(start)
    friction = _first_friction(seen.frames, spread.places, spread.loads, thing.friction)
    search = _Search(family, seen, thing, tip_radius, np.log(friction))
    z = np.append(start, np.log(friction))
    return search.result(search.run(z))


@dataclass(frozen=True, eq=False)
class _At:
    """The stretches rolled out for some numbers: errors (n, 3), and what they depend on."""

    z: Array
    errors: Array
    jacobian: Array | None
    covariance: Array
    good: np.ndarray
    sliding: float


class _Search:
    """Levenberg and Marquardt's method on stretches, each weighed by its own covariance and its distance."""

    def __init__(
        self, family: AbstractPressure, seen: Seen, thing: Object, tip_radius: float, friction: float
    ) -> None:
        self.family, self.seen, self.thing, self.tip_radius = family, seen, thing, tip_radius
        self.mean = np.append(family.mean, friction)
        self.precision = np.append(family.precision, SD_FRICTION**-2)

    def run(self, z: Array) -> tuple[_At, float]:
        at = self.roll(z)
        scale = 1.0
        damping = 1e-2
        for _ in range(_ROUNDS):
            scale = self._scale(at, at.covariance)
            fixed = at.covariance
            began = self._cost(at, fixed, scale)
            for _ in range(_STEPS):
                step, gain = self._step(at, fixed, scale, damping)
                tried = self.roll(at.z + step)
                before, after = self._cost(at, fixed, scale), self._cost(tried, fixed, scale)
                if after < before:
                    at, damping = tried, max(damping / 5, 1e-6)
                    if before - after < 1e-3 * (1 + 1e-3 * before):
                        break
                else:
                    damping *= 6
                    if damping > 1e4 or gain < 1e-3:
                        break
            if began - self._cost(at, fixed, scale) < 0.02:
                break
        return at, self._scale(at, at.covariance)

    def result(self, found: tuple[_At, float]) -> MotionFit:
        at, scale = found
        H, _ = self.normal(at, at.covariance, scale)
        covariance = np.asarray(np.linalg.inv(H), dtype=float)
        support = self.family.support(at.z[:-1])
        friction = float(np.exp(at.z[-1]))
        thing = Object(self.thing.outline, support, friction, None, self.thing.name)
        evidence = 2 * self._cost(at, at.covariance, 1.0) + float(np.linalg.slogdet(H)[1])
        evidence -= float(np.sum(np.log(self.precision))) + 2 * self.family.ways
        n = int(np.count_nonzero(at.good))
        return MotionFit(
            thing,
            self.family,
            at.z[:-1],
            covariance,
            float(np.sqrt(scale)),
            n,
            at.sliding,
            evidence,
            self.seen,
        )

    def roll(self, z: Array) -> _At:
        s = self.seen.stretches
        friction = float(np.exp(z[-1]))
        spread = self.family.at(z[:-1])
        support = self.family.support(z[:-1])
        plant = Plant(Object(self.thing.outline, support, friction), [[0.0, 0.0]], self.tip_radius)
        hands = np.concatenate([s.tips, np.zeros((*s.tips.shape[:2], 1))], axis=2)
        runs = plant.many(s.starts, hands, threads=1, record=True)
        assert runs.object is not None
        assert runs.modes is not None
        assert runs.points is not None
        points, modes = runs.points[:, :, 0], runs.modes[:, :, 0]
        tips = rotate(-runs.object[..., 2], s.tips - runs.object[..., :2])
        normals = points - tips
        length = np.linalg.norm(normals, axis=2, keepdims=True)
        if self.tip_radius > 1e-6:
            normals = normals / np.maximum(length, 1e-12)
        else:
            flat = [self.thing.outline.nearest(p).normal for p in points.reshape(-1, 2)]
            normals = np.reshape(flat, points.shape)
        way = Way(runs.object, modes, points, normals, s.tips)
        found = sensitivity(way, spread, friction)
        end = relative(runs.final, s.ends)
        end[:, 2] = np.arctan2(np.sin(end[:, 2]), np.cos(end[:, 2]))
        errors = log(end)
        good = (
            (runs.outcome == 0)
            & np.isfinite(found.numbers).all(axis=(1, 2))
            & np.isfinite(errors).all(axis=1)
        )
        J = np.where(good[:, None, None], found.numbers, 0.0)
        slid = float(np.mean(np.isin(modes[:, 1:], (LEFT, RIGHT))))
        return _At(z, np.where(good[:, None], errors, 0.0), J, self._covariance(s, found, good), good, slid)

    def _covariance(self, s: Stretches, found: Sensitivity, good: np.ndarray) -> Array:
        """Of the error of each end: its own noise, that of the start carried along, and of the model."""
        place, angle = self.seen.noise
        one = np.diag([place**2, place**2, angle**2])
        length = np.linalg.norm(s.tips[:, -1] - s.tips[:, 0], axis=1)
        off, turned = self.seen.model
        model = np.diag([off**2, off**2, turned**2])
        start = np.where(good[:, None, None], found.start, np.eye(3))
        carried = start @ one @ np.swapaxes(start, 1, 2)
        return (
            s.variance[:, 1, None, None] * one
            + s.variance[:, 0, None, None] * carried
            + length[:, None, None] ** 2 * model
        )

    def _distance(self, at: _At, covariance: Array) -> Array:
        """Squared distances of the ends, in their covariances."""
        solved = np.linalg.solve(covariance, at.errors[..., None])[..., 0]
        return np.asarray(np.sum(at.errors * solved, axis=1))

    def _scale(self, at: _At, covariance: Array) -> float:
        """How much more the ends scatter than noise explains."""
        if not at.good.any():
            raise FlatpushError("no stretch of these recordings could be rolled out")
        return max(1.0, float(np.median(self._distance(at, covariance)[at.good])) / _MEDIAN2)

    def _cost(self, at: _At, covariance: Array, scale: float) -> float:
        d = self._distance(at, covariance) / scale
        lost = 0.5 * SOFT**2 * np.log1p(d / SOFT**2)
        lost[~at.good] = 0.5 * SOFT**2 * np.log1p(25.0)  # as one five limits away
        pull = at.z - self.mean
        return float(np.sum(lost) + 0.5 * np.sum(self.precision * pull**2))

    def normal(self, at: _At, covariance: Array, scale: float) -> tuple[Array, Array]:
        assert at.jacobian is not None
        weights = 1 / (1 + self._distance(at, covariance) / scale / SOFT**2) / scale
        solved = np.linalg.solve(covariance, at.jacobian)
        H = np.einsum("n,nip,niq->pq", weights, at.jacobian, solved) + np.diag(self.precision)
        g = np.einsum("n,nip,ni->p", weights, solved, at.errors) - self.precision * (at.z - self.mean)
        return H, g

    def _step(self, at: _At, covariance: Array, scale: float, damping: float) -> tuple[Array, float]:
        H, g = self.normal(at, covariance, scale)
        step = np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
        step *= min(1.0, 1.5 / float(np.max(np.abs(step)) + 1e-12))
        step[-1] = np.clip(at.z[-1] + step[-1], np.log(0.01), np.log(MOST_FRICTION)) - at.z[-1]
        return np.asarray(step, dtype=float), float(g @ step)
