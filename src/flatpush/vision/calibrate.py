"""A camera from pictures of a checkerboard or of tags whose places are known: its lens, and where the table is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..geometry import cross, transform
from ..geometry.pose import Array
from ..geometry.table_camera import TableCamera
from .extra import opencv
from .tags import CORNERS, Picture, detect
from .worn import Tag

# Pictures that tell a lens at least, and how well the focal length must be known, as a share.
FEW, VAGUE = 3, 0.01
# A view is refused whose points are this far from their places, root mean square [px].
WRONG = 2.0
# A view tells nothing new whose points are all within this of those of an earlier one [px].
ALIKE = 3.0
# Sides of a board's fields [m].
FIELDS = (1e-4, 1.0)
# Points that a view needs.
POINTS = 8


@dataclass(frozen=True)
class Board:
    """A checkerboard.

    Attributes:
        columns, rows: of its inner corners, as numbers. square: side of a field [m].

    Raises:
        InputError: for fewer than 3 × 3 corners, or fields below 0.1 or above 1000 mm.
    """

    columns: int
    rows: int
    square: float

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 3 or not FIELDS[0] <= self.square <= FIELDS[1]:
            raise InputError(
                "a board has 3 × 3 inner corners or more, and fields of 0.1 to 1000 mm", key="board",
                value=f"{self.columns}x{self.rows},{1000 * self.square:g}",
            )  # fmt: skip

    def points(self, picture: Picture) -> tuple[Array, Array] | None:
        """Its inner corners in a picture (n, 2) [px] and on the board (n, 2) [m]; None where they are not seen.

        The board's frame begins at an outer one of these corners; x goes along its columns and as nearly to the right
        of the picture as it can, z up from its face.
        """
        cv2 = opencv()
        size = (self.columns, self.rows)
        there, corners = cv2.findChessboardCornersSB(picture, size, flags=cv2.CALIB_CB_ACCURACY)
        if not there:
            return None
        found = np.asarray(corners, dtype=float).reshape(self.rows, self.columns, 2)
        ends = [found, found[::-1, ::-1]]
        if self.rows == self.columns:
            ends += [np.swapaxes(end, 0, 1) for end in ends]
        # Seen from above, y is to the left of x: in a picture, whose v goes down, their product is negative.
        ends += [end[::-1] for end in ends]
        ends = [end for end in ends if cross(end[0, -1] - end[0, 0], end[-1, 0] - end[0, 0]) < 0]
        first = max(ends, key=lambda end: float((end[0, -1] - end[0, 0])[0]))
        y, x = np.meshgrid(np.arange(self.rows), np.arange(self.columns), indexing="ij")
        places = self.square * np.stack([x, y], axis=-1).astype(float)
        return first.reshape(-1, 2), places.reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class Fiducials:
    """Tags in one plane, at known places of it: on the table, or on a sheet that is also held up before the camera.

    Attributes:
        tags: with their poses in the frame of the plane.
    """

    tags: Sequence[Tag]

    def points(self, picture: Picture) -> tuple[Array, Array] | None:
        """Corners of those that are seen: in the picture (n, 2) [px] and in their plane (n, 2) [m].

        Raises:
            InputError: for a mirrored picture, and a tag that is in it twice.
        """
        found = detect(picture)
        numbers = [one.id for one in found]
        pixels, places = [], []
        for tag in self.tags:
            if numbers.count(tag.number) > 1:
                raise InputError(f"tag {tag.number} is in the picture twice")
            if tag.number in numbers:
                pixels.append(found[numbers.index(tag.number)].corners)
                places.append(transform(tag.pose, CORNERS * tag.size))
        if not pixels:
            check_mirrored(picture, [tag.number for tag in self.tags])
            return None
        return np.concatenate(pixels), np.concatenate(places)


def check_mirrored(picture: Picture, numbers: Sequence[int]) -> None:
    """Refuses a picture in which tags of these numbers are seen only as in a mirror.

    Raises:
        InputError: if so.
    """
    if any(one.id in numbers for one in detect(np.ascontiguousarray(picture[:, ::-1]))):
        raise InputError(
            "the picture is mirrored", hint="Switch off the mirror or flip of the camera's driver."
        )


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A camera, and how well it fits.

    Attributes:
        camera: found. rms: of all points of all pictures [px]. table_rms: of those on the table, with the lens that all
            pictures tell [px]. table_error: the same on the table [m].
        focal_sd: standard deviation of the focal length, as a share of it. used: how many pictures.
        unseen: names of pictures without the target.
    """

    camera: TableCamera
    rms: float
    table_rms: float
    table_error: float
    focal_sd: float
    used: int
    unseen: tuple[str, ...]


def calibrate(
    pictures: Sequence[tuple[str, Picture]], target: Board | Fiducials, table: int, origin: Array
) -> Calibrated:
    """The lens from all pictures, and the table from the one in which the target lies on it.

    Args:
        pictures: names for messages, and grey pictures of one size, (height, width) [px]. target: what is in them.
        table: index of the picture in which the target lies on the table. origin: pose of the target's frame in the
            table's, there, (3,) [m, m, rad].

    Raises:
        InputError: for too few pictures, pictures of several sizes, a table without the target, points that do not fit,
            and pictures that do not tell the focal length.
    """
    cv2 = opencv()
    h, w = pictures[0][1].shape
    views, names, unseen, of_table = [], [], [], None
    for k, (name, picture) in enumerate(pictures):
        if picture.shape != (h, w):
            raise InputError(
                f"all pictures have one size, {w} × {h} pixels", source=name, value=picture.shape[::-1]
            )
        try:
            seen = target.points(picture)
        except InputError as error:
            raise InputError(error.rule, source=name, hint=error.hint) from None
        if seen is None or len(seen[0]) < POINTS:
            unseen.append(name)
            continue
        if k == table:
            of_table = seen
        views.append(seen)
        names.append(name)
    if of_table is None:
        raise InputError(
            "the picture of the table does not show the target", source=pictures[table][0],
            hint="All of the board, or two fiducials or more, must be seen.",
        )  # fmt: skip
    if len(views) < FEW:
        raise InputError(
            f"{len(views)} of {len(pictures)} pictures show the target, and {FEW} or more are needed",
            hint="Hold it at different tilts, up to the corners of the picture.",
        )
    different = [k for k, view in enumerate(views) if not any(_alike(view, other) for other in views[:k])]
    if len(different) < FEW:
        raise InputError(
            f"only {len(different)} of {len(views)} pictures differ, and {FEW} or more are needed",
            value=", ".join(name for k, name in enumerate(names) if k not in different),
            hint="Hold the target at different tilts, up to the corners of the picture.",
        )
    flat = [np.column_stack([p, np.zeros(len(p))]).astype(np.float32) for _, p in views]
    pixels = [np.ascontiguousarray(u, dtype=np.float32).reshape(-1, 1, 2) for u, _ in views]
    rms, K, lens, *_, sd, _, each = cv2.calibrateCameraExtended(flat, pixels, (w, h), None, None)
    worst = int(np.argmax(each))
    if each[worst, 0] > WRONG:
        raise InputError(
            f"its points are {each[worst, 0]:.1f} pixels from where they should be", source=names[worst],
            hint="Is the board flat, its size right, and every tag where it is said to be?",
        )  # fmt: skip
    focal_sd = float(np.max(sd[:2, 0] / np.diag(K)[:2]))
    if not focal_sd < VAGUE:
        raise InputError(
            f"the pictures tell the focal length only to {100 * focal_sd:.1f} %",
            hint="Tilt the target by 20 to 40° in several of them.",
        )
    shown, plane = of_table
    places = np.column_stack([transform(origin, plane), np.zeros(len(plane))])
    _, turn, shift = cv2.solvePnP(places, shown.reshape(-1, 1, 2), K, lens, flags=cv2.SOLVEPNP_ITERATIVE)
    turn, shift = cv2.solvePnPRefineLM(places, shown.reshape(-1, 1, 2), K, lens, turn, shift)
    R = np.asarray(cv2.Rodrigues(turn)[0], dtype=float)
    camera = TableCamera((w, h), np.diag(K)[:2], K[:2, 2], lens.ravel()[:5], R, shift.ravel())
    off = camera.pixels(places) - shown
    on_table = camera.on_plane(shown) - places[:, :2]
    return Calibrated(
        camera,
        float(rms),
        float(np.sqrt(np.mean(np.sum(off**2, axis=1)))),
        float(np.sqrt(np.mean(np.sum(on_table**2, axis=1)))),
        focal_sd,
        len(views),
        tuple(unseen),
    )


def _alike(a: tuple[Array, Array], b: tuple[Array, Array]) -> bool:
    """Whether two views show the same points at the same places of the picture."""
    return bool(np.array_equal(a[1], b[1]) and np.max(np.abs(a[0] - b[0])) < ALIKE)
