"""A camera over the table: where a point of the table is in its picture, and back to a plane above the table."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from .pose import Array

# Newton steps that undo a lens; a lens that needs more than these within its picture folds over.
STEPS, CLOSE = 12, 1e-9
# A view this near to the horizon of a plane does not see it, as the sine of the angle.
GRAZING = 0.05


@dataclass(frozen=True, eq=False)
class TableCamera:
    """A pinhole with a lens, and the table in front of it.

    Pixels are (u, v), right and down, whole numbers at the middle of a pixel. The camera's frame has x right, y down
    and z ahead; the table's has z up.

    Attributes:
        size: width and height of its pictures [px].
        focal, centre: focal lengths and principal point, (2,) [px].
        distortion: coefficients of the lens k1, k2, p1, p2, k3 on rays (x/z, y/z), shape (5,).
        rotation, translation: of the table frame in the camera's, (3, 3) and (3,) [m]:
            p_C = rotation p_W + translation.

    Raises:
        InputError: for what is no camera: numbers that are not finite or not positive, a lens that folds over within
            the picture, a rotation that is none, a camera that is under its table.
    """

    size: tuple[int, int]
    focal: Array
    centre: Array
    distortion: Array
    rotation: Array
    translation: Array

    def __post_init__(self) -> None:
        shapes = {"focal": (2,), "centre": (2,), "distortion": (5,), "rotation": (3, 3), "translation": (3,)}
        for name, shape in shapes.items():
            value = np.array(getattr(self, name), dtype=float)
            if value.shape != shape or not np.all(np.isfinite(value)):
                raise InputError(
                    f"a camera has finite numbers of shape {shape}", key=name, value=value.tolist()
                )
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        if min(self.size) < 1 or np.min(self.focal) <= 0:
            raise InputError("picture and focal lengths are larger than 0", key="size", value=self.size)
        turned = np.abs(self.rotation @ self.rotation.T - np.eye(3)).max()
        if turned > 1e-6 or np.linalg.det(self.rotation) < 0:
            raise InputError("the table's pose has a rotation matrix", key="rotation", value=self.rotation)
        if self.position[2] <= 0:
            raise InputError(
                "the camera is above its table",
                key="translation",
                value=self.position,
                hint="Are the pictures mirrored?",
            )
        w, h = self.size
        rim = np.array([(u * (w - 1), v * (h - 1)) for u in (0, 0.5, 1) for v in (0, 0.5, 1)])
        if not np.allclose(self._projected(self.rays(rim)), rim, atol=0.01):
            raise InputError(
                "the lens folds its picture over", key="distortion", value=self.distortion,
                hint="Calibrate with pictures whose boards reach all corners.",
            )  # fmt: skip

    @property
    def position(self) -> Array:
        """Where the camera is in the table frame, (3,) [m]."""
        return np.asarray(-self.rotation.T @ self.translation)

    def pixels(self, points: ArrayLike) -> Array:
        """Where points (..., 3) of the table frame [m] are in the picture, (..., 2) [px]."""
        p = np.asarray(points, dtype=float) @ self.rotation.T + self.translation
        return self._projected(p[..., :2] / p[..., 2:])

    def rays(self, pixels: ArrayLike) -> Array:
        """The rays (x/z, y/z) of pixels (..., 2), in the camera's frame, with the lens undone by Newton's method."""
        wanted = (np.asarray(pixels, dtype=float) - self.centre) / self.focal
        ray = wanted.copy()
        for _ in range(STEPS):
            bent, slope = self._bent(ray)
            off = bent - wanted
            if np.max(np.abs(off), initial=0) < CLOSE:
                break
            a, b, c, d = slope
            det = a * d - b * c
            det = np.where(np.abs(det) < 1e-6, 1e-6, det)
            ray[..., 0] -= (d * off[..., 0] - b * off[..., 1]) / det
            ray[..., 1] -= (a * off[..., 1] - c * off[..., 0]) / det
        return ray

    def on_plane(self, pixels: ArrayLike, height: float = 0.0) -> Array:
        """The points (..., 2) [m] that pixels (..., 2) show of the plane at a height [m] over the table; nan where they
        show none."""
        ray = self.rays(pixels)
        ahead = np.concatenate([ray, np.ones_like(ray[..., :1])], axis=-1) @ self.rotation
        eye = self.position
        down = -ahead[..., 2] / np.linalg.norm(ahead, axis=-1)
        far = np.where(down > GRAZING, (height - eye[2]) / np.where(down > GRAZING, ahead[..., 2], 1), np.nan)
        return np.asarray(eye[:2] + far[..., None] * ahead[..., :2])

    def _projected(self, rays: Array) -> Array:
        return np.asarray(self._bent(rays)[0] * self.focal + self.centre)

    def _bent(self, ray: Array) -> tuple[Array, tuple[Array, Array, Array, Array]]:
        """Rays behind the lens (Brown's model), and the slopes ∂x'/∂x, ∂x'/∂y, ∂y'/∂x, ∂y'/∂y."""
        k1, k2, p1, p2, k3 = self.distortion
        x, y = ray[..., 0], ray[..., 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        rate = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))  # of the radial factor, over x and y
        bent = np.stack(
            [
                x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
            ],
            axis=-1,
        )
        across = rate * x * y + 2 * p1 * x + 2 * p2 * y
        return bent, (
            radial + rate * x * x + 2 * p1 * y + 6 * p2 * x,
            across,
            across,
            radial + rate * y * y + 6 * p1 * y + 2 * p2 * x,
        )
