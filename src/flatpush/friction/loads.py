"""How the load of an object is spread over places that are known, fitted to pairs of wrench and twist."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry import Outline
from ..geometry.pose import Array
from .exact import Exact
from .pairs import checked_pairs, typical_length
from .support import Support

_ROUNDS = 30  # of reweighting; the loads move by less than 1e-4 of their sum after about ten
_LEAST_RESIDUAL = 0.05  # of the median: below it residuals count as quadratic, so that no weight is infinite


@dataclass(frozen=True, eq=False)
class LoadsFit:
    """A support whose loads were fitted.

    Attributes:
        support: on feet, about the point that wrenches and twists are about.
        shares: of each part, shape (parts,), sum 1.
        resistance: table friction × load [N], fitted too.
    """

    support: Support
    shares: Array
    resistance: float

    @property
    def surface(self) -> Exact:
        """The exact limit surface of these loads."""
        return Exact(self.support)


def fit_loads(
    wrenches: ArrayLike,
    twists: ArrayLike,
    places: ArrayLike,
    parts: ArrayLike | None = None,
    *,
    nominal: ArrayLike | None = None,
    trust: float = 0.0,
    length: float | None = None,
) -> LoadsFit:
    """The loads at known places of a support that explain pairs of wrench and twist best under Coulomb friction.

    The wrench of a twist is a sum over the parts, linear in their loads c ≥ 0: minimises Σ |F - W(V) c|, torques
    over the length, by nonnegative least squares, reweighted. Unlike an ellipsoid or a quartic the result is the
    exact surface of a support, with all its edges, and has as few unknowns as the object has feet.

    Args:
        wrenches, twists: shape (n, 3), n > parts, about one point of the object.
        places: where the object presses, shape (k, 2), in coordinates whose origin is that point [m].
        parts: how a unit load of each part is spread over the places, shape (k, parts); default: each place is a
            part of its own.
        nominal: shares of the parts that are expected without data, shape (parts,).
        trust: from 0 (the data alone) to 1 (the nominal shares alone): the result is the mean with these weights.
        length: characteristic length [m]; default: as of fit_ellipsoid.

    Raises:
        InputError: if the pairs are too few or not finite, or nothing resists.

    >>> feet = [(-0.02, 0.0), (0.03, -0.01), (0.0, 0.03)]
    >>> V = np.random.default_rng(0).normal(size=(20, 3)) * [1, 1, 40]
    >>> F = Support.points(feet, [5, 2, 3]).wrench(V, friction=0.5, load=8)
    >>> found = fit_loads(F, V, feet)
    >>> np.round(found.shares, 4).tolist(), round(found.resistance, 4)
    ([0.5, 0.2, 0.3], 4.0)
    """
    points = np.array(places, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        raise InputError("the places of a load are a list of [x, y]", value=places)
    spread = np.eye(len(points)) if parts is None else np.array(parts, dtype=float)
    if (
        spread.ndim != 2
        or len(spread) != len(points)
        or np.any(spread < 0)
        or not np.all(np.any(spread, axis=0))
    ):
        raise InputError(
            "each part of a load is spread over the places, nowhere negative", value=spread.shape
        )
    spread = spread / np.sum(spread, axis=0)
    count = spread.shape[1]
    F, V = checked_pairs(wrenches, twists, count + 1, f"a fit of {count} loads")
    ell = typical_length(F, V) if length is None else float(length)
    c = _loads(F, _unit_wrenches(points, V) @ spread, ell)
    total = float(np.sum(c))
    if not total > 0:
        hint = "A wrench is what the pusher applies to the object."
        raise InputError("the wrenches oppose the twists: no load explains them", hint=hint)
    shares = _trusting(c / total, nominal, trust)
    return LoadsFit(Support.points(points, spread @ shares), shares, total)


def _unit_wrenches(points: Array, V: Array) -> Array:
    """The wrench of each twist at each place under a unit load, shape (n, 3, k); a place at rest adds nothing."""
    x, y = points.T
    vx, vy = V[:, :1] - V[:, 2:] * y, V[:, 1:2] + V[:, 2:] * x
    speed = np.hypot(vx, vy)
    speed = np.where(speed > 0, speed, np.inf)
    return np.stack([vx / speed, vy / speed, (x * vy - y * vx) / speed], axis=1)


def _loads(F: Array, W: Array, length: float) -> Array:
    from scipy.optimize import nnls

    units = np.array([1.0, 1.0, 1 / length])
    W, y = W * units[None, :, None], F * units
    weights = np.ones(len(F))
    for _ in range(_ROUNDS):
        c, _ = nnls((W * weights[:, None, None]).reshape(-1, W.shape[2]), (y * weights[:, None]).ravel())
        residual = np.linalg.norm(W @ c - y, axis=1)
        weights = 1 / np.sqrt(np.maximum(residual, _LEAST_RESIDUAL * np.median(residual) + 1e-12))
    return np.asarray(c)


def _trusting(shares: Array, nominal: ArrayLike | None, trust: float) -> Array:
    if not 0 <= trust <= 1:
        raise InputError("the trust in the nominal loads is between 0 and 1", value=trust)
    if nominal is None:
        if trust > 0:
            raise InputError("there are no nominal loads to trust", value=trust)
        return shares
    expected = np.asarray(nominal, dtype=float)
    if expected.shape != shares.shape or np.any(expected < 0) or not np.sum(expected) > 0:
        raise InputError("the nominal loads are as many as the parts, none negative", value=nominal)
    return (1 - trust) * shares + trust * expected / np.sum(expected)


def equilibrium(places: ArrayLike, centre: ArrayLike = (0.0, 0.0)) -> Array:
    """Shares of a load on feet (n, 2) whose centre is given, the nearest ones to equal shares; three feet have no
    others.

    >>> equilibrium([(-1, 0), (3, 0)]).round(6).tolist()
    [0.75, 0.25]

    Raises:
        InputError: if the centre is not between the feet.
    """
    from scipy.optimize import nnls

    p = np.asarray(places, dtype=float)
    n = len(p)
    size = float(np.max(np.abs(p - np.mean(p, axis=0)))) or 1.0
    rules = np.column_stack([np.ones(n), (p - np.asarray(centre, dtype=float)) / size])
    heavy = 1e6
    shares, _ = nnls(
        np.vstack([heavy * rules.T, np.eye(n)]), np.concatenate([[heavy, 0, 0], np.full(n, 1 / n)])
    )
    if np.max(np.abs(rules.T @ shares - [1, 0, 0])) > 1e-6:
        raise InputError("the centre of the load lies between the feet", value=np.asarray(centre).tolist())
    return shares / np.sum(shares)


def radial_parts(outline: Outline, rings: int = 4, across: int = 24) -> tuple[Array, Array, Array]:
    """Places inside a patch, parts of it from the middle to the rim, and their shares under uniform pressure.

    Each part is a density that rises from 0 to 1 at a radius and falls to 0 again at the next one (linear hats
    about the origin of the coordinates), so that any sum of them is a piecewise linear radial density.

    Args:
        outline: about the centre of friction.
        rings: how many; there is one part more.
        across: places along the longer side of the outline's box.
    """
    corners = outline.polyline()
    low, high = corners.min(axis=0), corners.max(axis=0)
    step = float(np.max(high - low)) / across
    axes = [
        a + step * (np.arange(max(1, round((b - a) / step))) + 0.5) for a, b in zip(low, high, strict=True)
    ]
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    points = grid[[outline.contains(p) for p in grid]]
    r = np.hypot(*points.T)
    radii = np.linspace(0.0, float(r.max()), rings + 1)
    hats = np.maximum(0.0, 1 - np.abs(r[:, None] - radii) / radii[1])
    hats = hats[:, np.any(hats > 0, axis=0)]
    shares = np.sum(hats, axis=0)
    return points, hats, shares / np.sum(shares)
