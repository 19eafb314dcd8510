"""The one interface behind which all limit surfaces stand."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..geometry.pose import Array


@dataclass(frozen=True)
class WrenchSet:
    """All wrenches of one twist: {centre + J_pᵀ g : |g| ≤ radius}, with J_pᵀ g the wrench of a force g at p.

    The radius is zero, and the set one wrench, unless the twist is a rotation about a support point p.

    Attributes:
        centre: the wrench in the middle of the set (fx, fy, τ), shape (3,), in the unit of the surface.
        point: the support point p, shape (2,) [m]; zeros where the radius is 0.
        radius: the largest free force of that point, in the unit of the surface.
    """

    centre: Array
    point: Array
    radius: float


class LimitSurface(ABC):
    """The boundary H(F) = 1 of the wrenches about the centre of friction that the table can resist.

    [Zhou2017] Eq. 1. Laws: H is convex, even and homogeneous, H(sF) = |s|^degree H(F); twist(F) is a
    positive multiple of ∇H(F); twist(wrench(V)) is one of V; maximal dissipation: wrench(V)·V ≥ F·V for all
    F with H(F) ≤ 1. All methods but stick and wrench_set broadcast over the leading axes of (..., 3).
    """

    degree: int

    @property
    def has_facets(self) -> bool:
        """Whether some twists have many wrenches, so that wrench_set may be more than one."""
        return False

    @abstractmethod
    def value(self, wrench: ArrayLike) -> Array:
        """H(F), 1 on the surface, shape (...), of wrenches F about the origin of the frame, shape (..., 3)."""

    @abstractmethod
    def twist(self, wrench: ArrayLike) -> Array:
        """A positive multiple of ∇H(F), shape (..., 3). Of a vertex's many twists, the middle one."""

    @abstractmethod
    def wrench(self, twist: ArrayLike) -> Array:
        """The wrench with H = 1 of a twist, shape (..., 3). Of a facet's many wrenches, the centre."""

    def wrench_set(self, twist: ArrayLike) -> WrenchSet:
        """All wrenches with H = 1 of one twist of shape (3,)."""
        return WrenchSet(self.wrench(twist), np.zeros(2), 0.0)

    def wrench_sets(self, twists: Array) -> list[WrenchSet]:
        """wrench_set of many twists, shape (n, 3)."""
        if self.has_facets:
            return [self.wrench_set(V) for V in twists]
        return [WrenchSet(W, np.zeros(2), 0.0) for W in self.wrench(twists)]

    def is_vertex(self, wrench: ArrayLike) -> bool:
        """Whether a wrench of shape (3,) has many twists, so that a force alone does not determine the motion."""
        return False

    @abstractmethod
    def stick(self, point: ArrayLike, velocity: ArrayLike) -> Array:
        """The twist of the body whose point (2,) is held to the velocity (2,) by a force through it.

        The inverse of [Zhou2017] Eq. 13: V = A Jᵀ f with J V = u. Its size is that of the velocity.
        """
