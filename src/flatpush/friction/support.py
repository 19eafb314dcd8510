"""Where an object presses on the table, and the Coulomb wrench that resists a motion."""

import warnings
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import finite, is_finite, vector
from ..errors import InputError
from ..geometry.outline import Outline
from ..geometry.pose import Array
from .pressure import Edges, Feet, Pressure, Round, edge_nodes

# Feet whose distance from their common line is within this part of the radius are collinear.
ON_LINE = 1e-9


class CollinearSupportWarning(UserWarning):
    """All feet stand on one line: the twist of some wrenches is not unique."""


@dataclass(frozen=True, eq=False)
class Support:
    """The pressure of an object on the table, of total load 1.

    Build with Support.points, .polygon, .outline, .disc or .ring; coordinates are those of any frame fixed
    in the object. Twists and wrenches are about the origin of these coordinates.

    >>> feet = Support.points([(-1, 0), (1, 0), (0, 3)])
    >>> feet.centre.tolist()
    [0.0, 1.0]
    >>> Support.disc(3.0).wrench([0, 0, 1], friction=0.5, load=2).tolist()  # 2/3 of the radius
    [0.0, 0.0, 2.0]

    Attributes:
        centre: centre of pressure, the centre of friction, shape (2,) [m].
        pressure: the pressure about its own centre.
    """

    centre: Array
    pressure: Pressure

    @classmethod
    def points(cls, xy: ArrayLike, weights: ArrayLike | None = None) -> "Support":
        """Feet at the points xy (n, 2) [m]. Only the ratios of their weights (n,) count; default: equal.

        Equal points are merged and points of no weight dropped. Warns with CollinearSupportWarning if all
        feet stand on one line, within 1e-9 of the radius.

        Raises:
            InputError: for a negative weight, no weight at all, or a single place (which resists no turning).
        """
        places = finite(xy, "the points of a support are finite numbers")
        if places.ndim != 2 or places.shape[1] != 2 or len(places) == 0:
            raise InputError("the points of a support are a list of [x, y]", value=xy)
        shares = (
            np.ones(len(places))
            if weights is None
            else finite(weights, "the weights of a support are finite numbers")
        )
        if shares.shape != (len(places),):
            raise InputError(f"a support of {len(places)} points has as many weights", value=weights)
        if np.any(shares < 0):
            raise InputError("the weights of a support are not negative", value=float(np.min(shares)))
        if not np.sum(shares) > 0:
            raise InputError("the weights of a support have a positive sum", value=float(np.sum(shares)))
        places, shares = places[shares > 0], shares[shares > 0] / np.sum(shares)
        if len(np.unique(places, axis=0)) < len(places):
            places, which = np.unique(places, axis=0, return_inverse=True)
            shares = np.bincount(np.ravel(which), weights=shares).astype(float)
        # About the first foot, so that far-away coordinates do not cancel.
        centre = places[0] + shares @ (places - places[0])
        feet = Feet(_kept(places - centre), _kept(shares))
        if feet.radius <= 1e-12 * float(np.max(np.abs(places))):
            raise InputError(
                "a support presses at two different places at least",
                value=places.tolist(),
                hint="A single point resists no turning.",
            )
        support = cls(_kept(centre), feet)
        if support.collinear:
            warnings.warn(
                "all feet of the support stand on one line: some wrenches have many twists",
                CollinearSupportWarning,
                stacklevel=2,
            )
        return support

    @classmethod
    def polygon(cls, vertices: ArrayLike) -> "Support":
        """Uniform pressure inside a simple polygon, corners (n, 2) [m] in either sense, convex or not."""
        return cls._edges(vertices, filled=True)

    @classmethod
    def outline(cls, vertices: ArrayLike) -> "Support":
        """Uniform pressure along the closed outline with the corners (n, 2) [m]."""
        return cls._edges(vertices, filled=False)

    @classmethod
    def disc(cls, radius: float, centre: ArrayLike = (0.0, 0.0)) -> "Support":
        """Uniform pressure over a disc: radius [m], centre, shape (2,) [m]."""
        return cls._round(radius, centre, filled=True)

    @classmethod
    def ring(cls, radius: float, centre: ArrayLike = (0.0, 0.0)) -> "Support":
        """Uniform pressure along a circle: radius [m], centre, shape (2,) [m]."""
        return cls._round(radius, centre, filled=False)

    @property
    def radius(self) -> float:
        """The largest distance of a pressed point from the centre [m]."""
        return self.pressure.radius

    @property
    def covariance(self) -> Array:
        """Second moments of the pressure about its centre, shape (2, 2) [m²]."""
        return self.pressure.covariance

    @property
    def feet(self) -> tuple[Array, Array]:
        """The points (n, 2) and weights (n,) of a support on feet; empty for a spread pressure."""
        if isinstance(self.pressure, Feet):
            return self.pressure.points + self.centre, self.pressure.weights
        return np.empty((0, 2)), np.empty(0)

    @cached_property
    def collinear(self) -> bool:
        """Whether all feet stand on one line, within 1e-9 of the radius."""
        if not isinstance(self.pressure, Feet):
            return False
        points = self.pressure.points
        far = points[np.argmax(np.hypot(*points.T))]
        away = np.max(np.abs(far[0] * points[:, 1] - far[1] * points[:, 0])) / np.hypot(*far)
        return bool(away <= ON_LINE * self.radius)

    def centred(self) -> "Support":
        """The same support, moved so that its centre is the origin."""
        return Support(_kept(np.zeros(2)), self.pressure)

    def translated(self, offset: ArrayLike) -> "Support":
        """The same support, moved by the offset (2,) [m]."""
        return Support(_kept(self.centre + np.asarray(offset, dtype=float)), self.pressure)

    def wrench(self, twist: ArrayLike, friction: float = 1.0, load: float = 1.0) -> Array:
        """The wrench that keeps up the motion: friction · load · ∫ v̂ dN and its moment ([Zhou2017] Eq. 1).

        It is what the pusher applies; the table applies its opposite. A foot that rests, because the
        rotation centre is within 1e-9 of the radius from it, contributes nothing: the centre of the facet
        of possible wrenches.

        Args:
            twist: (vx, vy, ω) about the origin of the coordinates, shape (..., 3); its size does not matter.
            friction: Coulomb coefficient with the table.
            load: total normal force [N].

        Returns:
            (fx, fy, τ) about the same origin, shape (..., 3), to 1e-9 of the load (torque: load × radius).

        Raises:
            InputError: if a twist is zero.
        """
        V = self._centred_twist(twist)
        flat = V.reshape(-1, 3)
        if not np.all(np.any(flat != 0, axis=1)):
            raise InputError("a zero twist has no wrench of its own", value=twist)
        if not (is_finite(friction) and is_finite(load) and friction >= 0 and load >= 0):
            raise InputError("friction and load are finite and not negative", value=(friction, load))
        W = self.pressure.wrench(flat).reshape(V.shape)
        W[..., 2] += self.centre[0] * W[..., 1] - self.centre[1] * W[..., 0]
        return (friction * load) * W

    def dissipation(self, twist: ArrayLike) -> Array:
        """h(V) = ∫ |v| dN, the power that friction takes at friction = load = 1, shape (...).

        It is the support function of the wrenches that the table can resist.
        """
        V = self._centred_twist(twist)
        flat = V.reshape(-1, 3)
        moves = np.any(flat != 0, axis=1)
        h = np.zeros(len(flat))
        h[moves] = self.pressure.resist(flat[moves])[0]
        return h.reshape(V.shape[:-1])

    def curvature(self, twist: ArrayLike) -> Array:
        """∇²h(V), the derivative of the wrench by the twist, shape (..., 3, 3). Resting feet are left out.

        Raises:
            InputError: for a zero twist.
        """
        V = self._centred_twist(twist)
        flat = V.reshape(-1, 3)
        if not np.all(np.any(flat != 0, axis=1)):
            raise InputError("a zero twist has no curvature", value=twist)
        shift = np.eye(3)
        shift[:2, 2] = -self.centre[1], self.centre[0]
        return (shift.T @ self.pressure.resist(flat)[2] @ shift).reshape(*V.shape, 3)

    def _centred_twist(self, twist: ArrayLike) -> Array:
        """The twists (..., 3), about the centre of pressure."""
        V = finite(twist, "a twist is three finite numbers (vx, vy, ω)")
        if V.shape[-1:] != (3,):
            raise InputError("a twist is three finite numbers (vx, vy, ω)", value=twist)
        V[..., 0] -= self.centre[1] * V[..., 2]
        V[..., 1] += self.centre[0] * V[..., 2]
        return V

    @classmethod
    def _edges(cls, vertices: ArrayLike, filled: bool) -> "Support":
        corners = Outline.polygon(vertices).vertices
        # About the first corner, so that far-away coordinates do not cancel.
        points, weights = edge_nodes(corners - corners[0], filled)
        centre = corners[0] + weights @ points / np.sum(weights)
        return cls(_kept(centre), Edges(_kept(corners - centre), filled))

    @classmethod
    def _round(cls, radius: float, centre: ArrayLike, filled: bool) -> "Support":
        if not (is_finite(radius) and radius > 0):
            raise InputError("the radius of a support is positive and finite", value=radius)
        place = vector(centre, 2, "the centre of a support is [x, y], finite numbers")
        return cls(_kept(place), Round(float(radius), filled))


def _kept(array: Array) -> Array:
    array.setflags(write=False)
    return array
