"""The rotation centres about which a two-finger push keeps both contacts, under a known limit surface."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..friction.surface import LimitSurface
from ..geometry.pose import Array
from .lynch_mason import clipped
from .wrench_cone import WrenchCone, straight_wrenches

# The boundary is refined until neighbouring twists differ by less than this angle [rad], at most this often.
FINE, DEEPEST, COARSE = np.deg2rad(2.0), 7, 6


@dataclass(frozen=True, eq=False)
class StableCentres:
    """The twists that some wrench of a composite cone makes, by their boundary.

    Attributes:
        boundary: unit twists (ω times the lever) of the wrenches around the cone, in order, shape (n, 3).
        translations: the two extreme directions of straight motion, unit vectors (2, 2); None if there are none.
        lever: unit of length of the twists [m].
    """

    boundary: Array
    translations: Array | None
    lever: float

    @classmethod
    def of(cls, cone: WrenchCone, surface: LimitSurface) -> "StableCentres":
        """The boundary is the image of the cone's faces: the map from wrench to twist keeps inside and outside.

        Raises:
            InputError: as WrenchCone.order.
        """
        rays = cone.wrenches[cone.order()]
        units = np.array([1.0, 1.0, cone.lever])

        def twist(F: Array) -> Array:
            V = surface.twist(F) * units
            return np.asarray(V / np.linalg.norm(V))

        def between(F: Array, G: Array, V: Array, W: Array, depth: int) -> list[Array]:
            if depth == 0 or float(V @ W) > np.cos(FINE):
                return []
            M = F + G
            U = twist(M)
            return [*between(F, M, V, U, depth - 1), U, *between(M, G, U, W, depth - 1)]

        found: list[Array] = []
        for F, G in zip(rays, np.roll(rays, -1, axis=0), strict=True):
            steps = [(1 - s) * F + s * G for s in np.arange(COARSE + 1) / COARSE]
            twists = [twist(S) for S in steps]
            for i in range(COARSE):
                found += [
                    twists[i],
                    *between(steps[i], steps[i + 1], twists[i], twists[i + 1], DEEPEST),
                ]
        pair = straight_wrenches(cone, surface)
        translations = None
        if pair is not None:
            ends = np.array([surface.twist(F)[:2] for F in pair])
            translations = ends / np.linalg.norm(ends, axis=1, keepdims=True)
        return cls(np.array(found), translations, cone.lever)

    def polygon(self, sense: int, box: Sequence[float]) -> Array:
        """The rotation centres inside a box (xmin, ymin, xmax, ymax), for the sense +1 (counter-clockwise) or -1.

        Returns:
            corners in order, about the COF, shape (n, 2); none where the box holds no centre.
        """
        # A centre c = (-vy, vx)/ω is on a side of the box where a linear function of the twist is not negative.
        x0, y0, x1, y1 = np.asarray(box, dtype=float) / self.lever
        V = sense * self.boundary
        for row in ([0, -1, -x0], [0, 1, x1], [1, 0, -y0], [-1, 0, y1], [0, 0, 1]):
            V = clipped(V, V @ np.array(row, dtype=float))
        V = V[V[:, 2] > 1e-12]
        return np.stack([-V[:, 1], V[:, 0]], axis=1) / V[:, 2:] * self.lever
