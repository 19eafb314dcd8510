"""Reads the outline of an object from a bitmap: a mask, or a photograph on a plain background."""

import os

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..geometry.pose import Array, cross
from .drawing import LeftOut
from .reading import read_bytes

TOLERANCE = 1.0  # of what is found, in pixels: half of it is the bitmap's own, half that of the smoothing
_BLUR = 1.0  # standard deviation of the blur that takes away the steps [pixels]
_WIDER = 2.0, 4.0, 8.0, 16.0  # of further blurs along the outline, where steps are long [pixels]
_STEP = 0.6  # an outline that such a blur moves by less had only steps there [pixels]
_SIMPLE = 0.15  # corners that change the outline less are left out [pixels]
# Sides with so many pixels, straight within so many, meet in a corner if their directions differ by this sine.
_SIDE = 12, 1.0, 0.6
_BLUNT = (
    0.9,
    0.5,
)  # by which the blur took away a corner: so much and so much over the sine of half its angle [pixels]
_SPECK = 0.01  # what is smaller than this part of the object is dirt
_SLACK, _BLURRED = (
    0.25,
    2,
)  # the threshold may be off by this part, and edges are no wider than twice as many pixels
_PLAIN = 0.1  # greatest spread of a plain background, as a part of its contrast with the object
_MOST_PIXELS = 40_000_000
_LEAST = 40  # corners of an outline that may be one of pixels, and pixels that it is across


def read_bitmap(path: str | os.PathLike[str]) -> tuple[Array, str, list[LeftOut], float]:
    """The outline of the one object in a bitmap, in pixels from its upper left corner with y up, shape (n, 2).

    Where there is transparency, what is opaque is the object; else what differs from the colour of the border.
    With it come what was taken, what was left out, and the tolerance [pixels].

    Raises:
        InputError: if the file is no bitmap, its background is not plain, or it does not show one whole object.
    """
    source = os.fspath(path)
    contrast = _contrast(path, source)
    threshold = _threshold(contrast) if np.ptp(contrast) > 0 else np.inf
    inside = contrast > threshold
    border = np.concatenate([inside[0], inside[-1], inside[:, 0], inside[:, -1]])
    if not inside.any() or inside.all():
        raise InputError("the bitmap shows no object", source=source, hint=_HINT)
    if border.any():
        raise InputError("the object touches the edge of the bitmap", source=source, hint=_HINT)
    from scipy import ndimage

    labels, count = ndimage.label(inside, structure=np.ones((3, 3)))
    sizes = np.bincount(labels.ravel())[1:]
    large = np.flatnonzero(sizes > _SPECK * sizes.max()) + 1
    if len(large) > 1:
        centres = ndimage.center_of_mass(inside, labels, large[:4])
        where = "; ".join(f"({x:.0f}, {y:.0f})" for y, x in centres)
        raise InputError(
            f"the bitmap shows {len(large)} objects, not one, around the pixels {where}",
            source=source,
            hint=_HINT,
        )
    whole = ndimage.binary_fill_holes(labels == large[0])
    loose, strict = (ndimage.binary_fill_holes(contrast > k * threshold) for k in (1 - _SLACK, 1 + _SLACK))
    doubtful = ndimage.binary_erosion(loose & ~strict, iterations=_BLURRED)
    if int(doubtful.sum()) > 0.1 * _SPECK * int(whole.sum()):
        y, x = ndimage.center_of_mass(doubtful)
        raise InputError(
            f"where the object ends is not clear around the pixel ({x:.0f}, {y:.0f}): there may be a shadow",
            source=source,
            hint=_HINT,
        )
    left = []
    if count > 1:
        left.append(LeftOut(f"{count - 1} specks", "smaller than 1 % of the object"))
    if int(whole.sum()) > int(sizes.max()):
        left.append(LeftOut("what is inside the outline", "inside the outline (a hole)"))
    smooth = smooth_outline(whole)
    if smooth is None:
        raise InputError(
            "the object has parts thinner than three pixels, or is no larger",
            source=source,
            hint="Give a finer bitmap.",
        )
    points = smooth * (1.0, -1.0)
    return points, f"the object of {int(sizes.max())} pixels", left, TOLERANCE


def smooth_outline(mask: NDArray[np.bool_]) -> Array | None:
    """The outline of the only region of a mask without its steps, shape (n, 2): x to the right, y down [pixels].

    A pixel of column c and row r covers c to c + 1 and r to r + 1. None where smoothing would part the region or take
    it away: what is thinner than about three pixels.
    """
    from contourpy import LineType, contour_generator
    from scipy import ndimage
    from shapely import Polygon

    pad = 4
    blurred = ndimage.gaussian_filter(np.pad(mask, pad).astype(float), _BLUR)
    lines = contour_generator(z=blurred, line_type=LineType.Separate).lines(0.5)
    shapes = sorted(
        (Polygon(line + (0.5 - pad)) for line in lines if len(line) > 3), key=lambda shape: shape.area
    )
    if not shapes or sum(shape.area for shape in shapes[:-1]) > _SPECK * shapes[-1].area:
        return None
    line = shapes[-1].exterior
    count = max(int(line.length), 8)
    even = np.array([line.interpolate(k / count, normalized=True).coords[0] for k in range(count)])
    smooth = _without_long_steps(even)
    sharp = Polygon(_with_sharp_corners(even, smooth))
    best = next((shape for shape in (sharp, Polygon(smooth)) if shape.is_valid), shapes[-1])
    return np.array(best.simplify(_SIMPLE).exterior.coords)[:-1]


def _with_sharp_corners(points: Array, smooth: Array) -> Array:
    """The smooth outline, with straight sides and the corner that was blurred between them where two of them meet.

    Args:
        points: a closed outline (n, 2), about one pixel apart, with its steps; smooth: the same without them.
    """
    from shapely import LinearRing, LineString, Point

    n = len(points)
    rough = np.array(LinearRing(points).simplify(_SIDE[1]).coords)[:-1]
    at = sorted(int(np.argmin(np.hypot(*(points - corner).T))) for corner in rough)
    sides = []  # first and last of its points, a point of its line, its direction
    for first, last in zip(at, [*at[1:], at[0] + n], strict=True):
        if last - first >= _SIDE[0]:
            of = points[np.arange(first + 3, last - 2) % n]
            along = np.linalg.svd(of - of.mean(axis=0))[2][0]
            sides.append((first, last, of.mean(axis=0), along * np.sign(along @ (of[-1] - of[0]))))
    result = smooth.copy()
    for (first, last, p, u), (start, end, q, v) in zip(sides, [*sides[1:], *sides[:1]], strict=True):
        start, end = start + n * (start < first), end + n * (start < first)
        bend = float(cross(u, v))
        if abs(bend) < _SIDE[2] or start - last > _SIDE[0]:
            continue
        meet = p + u * float(cross(q - p, v)) / bend
        # The more a corner is pointed, the more of it a blur takes away; a fillet takes more.
        half = np.sqrt(max((1 + float(u @ v)) / 2, 1e-3))  # sine of half the angle
        between = np.arange(last - 3, start + 4) % n
        if LineString(points[between]).distance(Point(meet)) > _BLUNT[0] + _BLUNT[1] / half:
            continue
        before, after = (
            np.arange((first + last) // 2, last - 2) % n,
            np.arange(start + 3, (start + end) // 2) % n,
        )
        result[before] = meet + np.minimum((result[before] - meet) @ u, 0.0)[:, None] * u
        result[after] = meet + np.maximum((result[after] - meet) @ v, 0.0)[:, None] * v
        result[between] = meet
    return result


def _without_long_steps(points: Array) -> Array:
    """A closed outline of points one pixel apart, (n, 2), blurred along itself as far as only steps go away.

    An edge that is nearly along an axis has steps many pixels long. Near corners and bends, which a wider blur would
    move, the outline stays as it is.
    """
    from scipy import ndimage

    def blur(values: Array, width: float) -> Array:
        return ndimage.gaussian_filter1d(values, width, axis=0, mode="wrap")

    result, clear = points, np.ones(len(points), dtype=bool)
    for width in _WIDER:
        once = blur(points, width)
        wide = once + blur(points - once, width)  # twice, so that a circle keeps its radius
        moved = np.hypot(*(wide - points).T)
        clear &= ndimage.maximum_filter1d(moved, 2 * int(3 * width) + 1, mode="wrap") < _STEP
        share = blur(clear.astype(float), width)[:, None]
        result = result + np.where(clear[:, None], share, 0.0) * (wide - result)
    return result


def without_steps(corners: Array) -> tuple[Array, float] | None:
    """An outline of pixels without its steps, shape (n, 2), and the tolerance; None if it is not one of pixels.

    Of pixels is what goes along the axes in multiples of one length, turning to the left and to the right by turns;
    corners within a straight side do not matter.
    """
    bends = cross(corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners)
    corners = corners[
        np.abs(bends) > 1e-9 * np.ptp(corners, axis=0).max() ** 2
    ]  # not those within a straight side
    if len(corners) < _LEAST:
        return None
    edges = np.roll(corners, -1, axis=0) - corners
    lengths = np.abs(edges).max(axis=1)
    step = float(lengths.min())
    if (
        step <= 0
        or np.abs(edges).min(axis=1).max() > 1e-6 * step
        or np.ptp(corners, axis=0).max() < _LEAST * step
    ):
        return None
    low = corners.min(axis=0)
    cells = (corners - low) / step
    if np.abs(cells - np.round(cells)).max() > 1e-3 or np.prod(np.ptp(cells, axis=0)) > _MOST_PIXELS:
        return None
    turns = np.sign(np.round(cross(np.roll(edges, 1, axis=0), edges) / step**2))
    if np.mean(turns * np.roll(turns, 1) < 0) < 0.8:
        return None
    cells = np.round(cells).astype(int)
    width, height = cells.max(axis=0)
    flips = np.zeros((height, width + 1), dtype=int)
    for (x, y0), (x1, y1) in zip(cells, np.roll(cells, -1, axis=0), strict=True):
        if x == x1:
            flips[min(y0, y1) : max(y0, y1), x] += 1
    smooth = smooth_outline(np.cumsum(flips, axis=1)[:, :-1] % 2 == 1)
    return None if smooth is None else (low + step * smooth, TOLERANCE * step)


_HINT = "Give a mask, or a photograph of the whole object alone on a plain background."


def _contrast(path: str | os.PathLike[str], source: str) -> Array:
    """How far each pixel is from the background, (rows, columns)."""
    import io

    from PIL import Image, ImageOps, UnidentifiedImageError

    content = read_bytes(path, 100_000_000)
    try:
        with Image.open(io.BytesIO(content)) as image:
            if image.width * image.height > _MOST_PIXELS:
                raise InputError(
                    "a bitmap has at most 40 million pixels", source=source, hint="Make it smaller."
                )
            upright = ImageOps.exif_transpose(image)
            if upright.mode[0] in "IF":  # more than 8 bits, which a conversion would cut off
                return _away(np.asarray(upright, dtype=float)[..., None], source)
            colours = np.asarray(upright.convert("RGBA"), dtype=float)
    except (UnidentifiedImageError, Image.DecompressionBombError, OSError, ValueError, SyntaxError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            "this is not a bitmap", source=source, hint="Is it the right file, and is it complete?"
        ) from error
    if np.ptp(colours[..., 3]) > 0:
        return colours[..., 3]
    return _away(colours[..., :3], source)


def _away(rgb: Array, source: str) -> Array:
    """How far each pixel (rows, columns, channels) is from the colour of the border; that must be plain."""
    rim = np.concatenate([rgb[0], rgb[-1], rgb[:, 0], rgb[:, -1]])
    background = np.median(rim, axis=0)
    contrast = np.abs(rgb - background).max(axis=-1)
    spread = float(np.percentile(np.abs(rim - background).max(axis=-1), 95))
    if not np.all(np.isfinite(rgb)) or spread > _PLAIN * float(np.percentile(contrast, 99)):
        raise InputError("the background of the bitmap is not plain", source=source, hint=_HINT)
    return contrast


def _threshold(values: Array) -> float:
    """The value that parts two groups with the least variance inside them (Otsu)."""
    counts, limits = np.histogram(values, bins=256)
    middles = (limits[:-1] + limits[1:]) / 2
    below = np.cumsum(counts)
    above = below[-1] - below
    sums = np.cumsum(counts * middles)
    with np.errstate(invalid="ignore", divide="ignore"):
        between = below * above * (sums / below - (sums[-1] - sums) / above) ** 2
    return float(limits[1:][int(np.nanargmax(between[:-1]))])
