"""A camera over a table for tests: what it would draw, and pictures of boards and sheets from many sides."""

import numpy as np

from flatpush.geometry.table_camera import TableCamera
from flatpush.vision.synthetic import Spoil, SyntheticCamera
from flatpush.vision.worn import Tag

SIZE = (1280, 960)
LENS = (-0.18, 0.05, 0.001, -0.0008, 0.0)
TOP = np.array([(-0.03, -0.025), (0.03, -0.025), (0.03, 0.025), (-0.03, 0.025)])


def over(distance=0.5, tilt=0.0, turn=0.0, lens=LENS, focal=1400.0, aside=(0.0, 0.0)) -> TableCamera:
    """A camera that looks at the table's origin from a distance [m], tilted and turned [rad], moved aside [m]."""
    c, s = np.cos(tilt), np.sin(tilt)
    tilted = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    c, s = np.cos(turn), np.sin(turn)
    turned = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    R = tilted @ turned @ np.diag([1.0, -1.0, -1.0])
    return TableCamera(
        SIZE, np.array([focal, focal]), np.array([630.0, 485.0]), np.array(lens), R, [*aside, distance]
    )


def watching(camera, tags=None, spoil=None, **more) -> SyntheticCamera:
    """It draws a block of 60 × 50 mm with a tag of 30 mm on its top."""
    worn = {"object": Tag(3, 0.03, 0.02, np.array([0.003, -0.002, 0.2]))} if tags is None else tags
    return SyntheticCamera(camera, worn, {"object": TOP}, spoil=spoil or Spoil(), **more)


# A sheet of tags at known places, and the sides from which it is seen: (distance, tilt, turn, aside).
SHEET = [(10 + k, 0.035, np.array([0.09 * (k % 4 - 1.5), 0.09 * (k // 4 - 1), 0.3 * k])) for k in range(12)]
SIDES = [
    (0.55, 0.0, 0.0, (0.0, 0.0)), (0.5, 0.5, 0.3, (0.02, 0.0)), (0.55, 0.4, 1.6, (0.03, 0.02)),
    (0.5, -0.4, -2.0, (-0.03, 0.0)),
]  # fmt: skip


def sheets(spoil=None, rng=None):
    """Pictures of the sheet, the first as it lies on the table below the camera `over(*SIDES[0])`."""
    return [
        SyntheticCamera(over(d, tilt, turn, aside=aside), fiducials=SHEET, spoil=spoil or Spoil()).picture({}, rng)
        for d, tilt, turn, aside in SIDES
    ]  # fmt: skip


def board(camera, columns, rows, square):
    """A checkerboard on the table, drawn four times as fine: its first inner corner is the origin, x along columns."""
    import cv2

    fine = 4
    seen = np.full((SIZE[1] * fine, SIZE[0] * fine), 220, np.uint8)
    for i in range(-1, columns):
        for j in range(-1, rows):
            if (i + j) % 2:
                continue
            a, b = np.array([i, i + 1]) * square, np.array([j, j + 1]) * square
            corners = [(a[0], b[0], 0), (a[1], b[0], 0), (a[1], b[1], 0), (a[0], b[1], 0)]
            around = (camera.pixels(corners) + 0.5) * fine - 0.5
            cv2.fillPoly(seen, [np.round(around * 256).astype(np.int32)], 30, shift=8)
    return cv2.resize(seen, SIZE, interpolation=cv2.INTER_AREA)
