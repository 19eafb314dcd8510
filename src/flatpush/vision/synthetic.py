"""A synthetic camera: pictures of tags on a table and on objects, with what spoils real ones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..geometry import compose, inverse, transform
from ..geometry.pose import Array
from ..geometry.table_camera import TableCamera
from .extra import opencv
from .tags import BLACK, WHOLE, Picture, cells
from .worn import Tag

Grey = NDArray[np.float32]

# Rays through each pixel, along each side: so a cell's edge is drawn to a sixteenth of a grey level step.
RAYS = 4
PAPER, INK, TABLE, TOP = 230.0, 25.0, 150.0, 95.0  # grey levels


@dataclass(frozen=True)
class Spoil:
    """What spoils a picture.

    Attributes:
        noise: standard deviation of each pixel [grey levels]. blur: standard deviation of the blur [px].
        glare: brightness of a bright patch at a random place [grey levels]. glare_size: its standard deviation [px].
        covered: width of a bar that lies at random near a tag, as a share of the tag's side; 0: none.
        light: factor of all brightness. gradient: by which share the light falls off across the picture.
    """

    noise: float = 0.0
    blur: float = 0.0
    glare: float = 0.0
    glare_size: float = 60.0
    covered: float = 0.0
    light: float = 1.0
    gradient: float = 0.0


@dataclass(frozen=True, eq=False)
class SyntheticCamera:
    """Draws what a camera would see.

    Args:
        camera: where it is, and its lens.
        tags: on objects, by the name of the object.
        outlines: corners of objects' tops in their frame (n, 2) [m], at the height of their tag.
        fiducials: number, size [m] and pose X_WT (3,) of tags that lie on the table.
        spoil: what spoils its pictures.
    """

    camera: TableCamera
    tags: Mapping[str, Tag] = field(default_factory=dict)
    outlines: Mapping[str, Array] = field(default_factory=dict)
    fiducials: Sequence[tuple[int, float, Array]] = ()
    spoil: Spoil = field(default_factory=Spoil)

    def picture(self, poses: Mapping[str, Array], rng: np.random.Generator | None = None) -> Picture:
        """With the objects at poses X_WO (3,), grey, shape (height, width). rng: of noise, glare and the bar."""
        w, h = self.camera.size
        seen: Grey = np.full((h, w), TABLE, dtype=np.float32)
        for number, size, pose in self.fiducials:
            self._draw(seen, number, size, np.asarray(pose, dtype=float), 0.0)
        boxes = []
        for name, pose in poses.items():
            tag = self.tags[name]
            if name in self.outlines:
                self._fill(seen, transform(pose, self.outlines[name]), tag.height, TOP)
            boxes.append(self._draw(seen, tag.number, tag.size, compose(pose, tag.pose), tag.height))
        return self._spoiled(seen, boxes, rng or np.random.default_rng(0))

    def _fill(self, seen: Grey, corners: Array, height: float, grey: float) -> None:
        around = self.camera.pixels(np.column_stack([corners, np.full(len(corners), height)]))
        opencv().fillPoly(seen, [np.round(around * 256).astype(np.int32)], grey, shift=8)

    def _draw(self, seen: Grey, number: int, size: float, X_WT: Array, height: float) -> Array:
        """One tag; returns its four corners in the picture."""
        half = 0.5 * size * WHOLE / BLACK
        rim = transform(X_WT, [[-half, -half], [half, -half], [half, half], [-half, half]])
        around = self.camera.pixels(np.column_stack([rim, np.full(4, height)]))
        low = np.maximum(np.floor(around.min(axis=0)).astype(int) - 2, 0)
        high = np.minimum(np.ceil(around.max(axis=0)).astype(int) + 3, self.camera.size)
        if np.any(low >= high):
            return around
        (u0, v0), (u1, v1) = low, high
        # The plane is straight enough within a pixel: its place and slopes at the middle give those of all rays.
        u, v = np.arange(u0 - 1, u1 + 1), np.arange(v0 - 1, v1 + 1)
        plane = transform(inverse(X_WT), self.camera.on_plane(np.stack(np.meshgrid(u, v), axis=-1), height))
        down, right = np.gradient(plane, axis=0), np.gradient(plane, axis=1)
        fine = (np.arange(RAYS) + 0.5) / RAYS - 0.5
        inner = (slice(1, -1), None, slice(1, -1), None)
        at = plane[inner] + fine[:, None, None, None] * down[inner] + fine[:, None] * right[inner]
        column = np.floor(at[..., 0] / size * BLACK + WHOLE / 2)
        row = np.floor(WHOLE / 2 - at[..., 1] / size * BLACK)
        inside = (column >= 0) & (column < WHOLE) & (row >= 0) & (row < WHOLE)
        white = cells(number)[np.where(inside, row, 0).astype(int), np.where(inside, column, 0).astype(int)]
        covers = inside.mean(axis=(1, 3))
        grey = np.where(inside, np.where(white, PAPER, INK), 0.0).mean(axis=(1, 3))
        seen[v0:v1, u0:u1] = grey + (1 - covers) * seen[v0:v1, u0:u1]
        return around

    def _spoiled(self, seen: Grey, boxes: Sequence[Array], rng: np.random.Generator) -> Picture:
        s, (w, h) = self.spoil, self.camera.size
        if s.covered > 0 and boxes:
            box = boxes[int(rng.integers(len(boxes)))]
            side = np.linalg.norm(box[1] - box[0]) * BLACK / WHOLE
            middle = box.mean(axis=0) + rng.uniform(-0.8, 0.8, 2) * side
            along = rng.uniform(0, np.pi)
            d = np.array([np.cos(along), np.sin(along)])
            n = np.array([-d[1], d[0]])
            bar = middle + np.array(
                [
                    a * 4 * side * d + b * 0.5 * s.covered * side * n
                    for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
                ]
            )
            grey = float(rng.uniform(20, 240))
            opencv().fillPoly(seen, [np.round(bar * 256).astype(np.int32)], grey, shift=8)
        if s.gradient:
            seen = seen * np.float32(1 - s.gradient * np.linspace(0, 1, w))
        if s.glare > 0:
            place = boxes[int(rng.integers(len(boxes)))].mean(axis=0) if boxes else np.array([w, h]) / 2
            u, v = place + rng.normal(size=2) * s.glare_size
            du, dv = (
                np.exp(-0.5 * ((np.arange(w) - u) / s.glare_size) ** 2),
                np.exp(-0.5 * ((np.arange(h) - v) / s.glare_size) ** 2),
            )
            seen = (seen + s.glare * dv[:, None] * du).astype(np.float32)
        if s.blur > 0:
            seen = opencv().GaussianBlur(seen, (0, 0), s.blur)
        if s.light != 1:
            seen = seen * np.float32(s.light)
        if s.noise > 0:
            seen = seen + np.float32(s.noise) * rng.standard_normal(seen.shape, dtype=np.float32)
        return np.asarray(np.clip(np.rint(seen), 0, 255).astype(np.uint8))
