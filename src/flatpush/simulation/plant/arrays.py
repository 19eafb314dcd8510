"""Limit surfaces, outlines and poses as data with names, for the plant's steps.

Every class comes in two kinds with the same names: with plain numbers and sequences of rows, which Python reads
quickly, and in a kernel, with numbers and record arrays. A kernel is given record arrays alone and makes the classes of
them, since passing a NamedTuple to a kernel costs more than a step of the plant.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ...errors import FlatpushError
from ...friction import Ellipsoid, Exact, LimitSurface, Quartic
from ...friction.pressure import Edges, Feet, Round
from ...geometry import Outline
from ...geometry.pose import Array

SeenRows = Any  # an array of SEEN rows; numpy's types do not know columns by name
ArraysT = TypeVar("ArraysT", bound=tuple[object, ...])
Rows = Any  # a sequence of rows with named columns, or a record array


class Row:
    """A row that Python writes to, with the columns of a record."""

    def __init__(self, names: Sequence[str]) -> None:
        self.__dict__.update(dict.fromkeys(names, 0.0))

    if TYPE_CHECKING:  # its columns

        def __getattr__(self, name: str) -> Any: ...
        def __setattr__(self, name: str, value: float) -> None: ...


def _record(numbers: str, codes: str = "") -> np.dtype:
    return np.dtype([(name, "f8") for name in numbers.split()] + [(name, "i8") for name in codes.split()])


POINT = _record("x y")
POSE = _record("x y angle")  # X_WO or X_WE, or a displacement
SEEN = _record(
    "x y gap", "mode modes"
)  # the nearest point in O, its gap, last mode, all modes as bits 1 << mode
CONTACT = _record(
    "x y nx ny ux uy gap", "finger feature"
)  # about the COF in O: point, normal, the finger's velocity
RAY = _record("x y t")
EDGE = _record(
    "x y ex ey length nx ny convex"
)  # start, direction, inward normal, whether the start's corner is convex
FOOT = _record(
    "x y weight power fx fy t"
)  # of the rotation about the foot: dissipation, wrench of the others
SIDE = _record(
    "ex ey first last distance"
)  # a straight piece of a support: direction, ends along it, distance
ELLIPSE = _record("xx xy xt yy yt tt ixx ixy ixt iyy iyt itt")  # the symmetric matrix A, and its inverse
TERMS = _record("xxxx yyyy zzzz xxxy xxxz yyyx yyyz zzzx zzzy xxyy xxzz yyzz xxyz yyxz zzxy")
OUTLINE = _record("x y radius size tip", "circle convex")  # OutlineArrays but the edges, and the tips' radius
COURSE = _record("", "first last surfaces hands number begin kind rows push_out")
# Of runs first to last: how many surfaces there are (one, or one for each run), how many hands, poses of each, the pose
# that is gone to first (1: the state at the first is known), how they go from one to the next (codes.STRAIGHT and
# others), poses of the object that are kept of each run (1 or all), whether it is moved out of the fingers first.
RUN = _record("x y angle", "status reached")  # where the object starts; how the run ended, poses reached


class EllipsoidArrays(NamedTuple):
    """unit: of length ℓ [m]. ellipse: one ELLIPSE row; A in ℓ, of trace 3."""

    unit: float
    ellipse: Rows


class QuarticArrays(NamedTuple):
    """unit: of length ℓ [m]. terms: one TERMS row; coefficients by their monomials, balanced."""

    unit: float
    terms: Rows


class FeetArrays(NamedTuple):
    """unit: of length ℓ [m]. radius: of the support [ℓ]. feet: FOOT rows, about the COF, lengths in ℓ."""

    unit: float
    radius: float
    feet: Rows


class SidesArrays(NamedTuple):
    """A uniform pressure on a polygon's outline, or inside it.

    unit: of length ℓ [m]. radius: of the support [ℓ]. size: its length or area [ℓ, ℓ²]. filled: whether inside.
    x, y: the origin of its own coordinates, seen from the COF [ℓ]. sides: SIDE rows about the COF.
    nodes: FOOT rows that stand for it from far away.
    """

    unit: float
    radius: float
    filled: bool
    size: float
    x: float
    y: float
    sides: Rows
    nodes: Rows


class RoundArrays(NamedTuple):
    """A uniform pressure on a circle, or inside it: as SidesArrays."""

    unit: float
    radius: float
    filled: bool
    x: float
    y: float
    nodes: Rows


SurfaceArrays = EllipsoidArrays | QuarticArrays | FeetArrays | SidesArrays | RoundArrays


def _body(*columns: str) -> np.dtype:
    return _record(" ".join(("cof_x cof_y friction unit", *columns)))


BODIES: dict[type[SurfaceArrays], np.dtype] = {
    EllipsoidArrays: _body(*(ELLIPSE.names or ())),
    QuarticArrays: _body(*(TERMS.names or ())),
    FeetArrays: _body("radius"),
    SidesArrays: _body("radius filled size x y"),
    RoundArrays: _body("radius filled x y"),
}
"""What a run has of its own, in one row for each kind of surface: Setting's numbers, and the surface's."""


class OutlineArrays(NamedTuple):
    """A polygon's EDGE rows, counter-clockwise, or a circle. All in O, in metres.

    circle: whether it is one, with centre x, y and radius. convex: whether all corners are. size: of the outline.
    """

    circle: bool
    x: float
    y: float
    radius: float
    convex: bool
    size: float
    edges: Rows


class Setting(NamedTuple):
    """What a run does not change. cof_x, cof_y: in O. radius: of the fingertips. fingers: POINT rows in E."""

    surface: SurfaceArrays
    cof_x: float
    cof_y: float
    outline: OutlineArrays
    friction: float
    radius: float
    fingers: Rows


class RunArrays(NamedTuple):
    """Rows of BODIES, one for all runs or one each; FOOT and SIDE rows of their surfaces, one after the other."""

    bodies: Rows
    feet: Rows
    sides: Rows


class Move(NamedTuple):
    """A step of the hands.

    hands: POSE rows, one or one for each finger. steps: their displacements. kind: codes.BODY, or straight.
    """

    hands: Rows
    steps: Rows
    kind: int


class Scratch(NamedTuple):
    """What a step writes to. contacts: 4 CONTACT rows. rays, planes: RAY rows, 4 and 12. q: one POSE row.
    hands, steps: a POSE row for each finger. now: a SEEN row for each finger."""

    contacts: Rows
    rays: Rows
    planes: Rows
    q: Rows
    hands: Rows
    steps: Rows
    now: Rows


SCRATCH = np.dtype(
    [
        ("contacts", CONTACT, 4),
        ("rays", RAY, 4),
        ("planes", RAY, 12),
        ("q", POSE, (1,)),  # one row, not a row by itself, for every numpy
        ("hands", POSE, 2),
        ("steps", POSE, 2),
        ("now", SEEN, 2),
    ]
)


def scratch() -> Scratch:
    """Room for the steps of one or two fingers, interpreted."""
    made = {}
    for name in Scratch._fields:
        field = SCRATCH[name]
        made[name] = blank(field.base, field.shape[0])
    return Scratch(**made)


def blank(dtype: np.dtype, count: int) -> list[Row]:
    """Rows that Python writes to."""
    return [Row(dtype.names or ()) for _ in range(count)]


def plain_rows(rows: Array) -> Rows:
    """A record array as NamedTuples of Python's numbers."""
    if rows.dtype not in _PLAIN:  # making a class takes a millisecond
        columns: Any = [(name, float) for name in rows.dtype.names or ()]
        _PLAIN[rows.dtype] = NamedTuple("Plain", columns)
    return [_PLAIN[rows.dtype](*row) for row in rows.tolist()]


_PLAIN: dict[np.dtype, Any] = {}


def interpreted(arrays: ArraysT) -> ArraysT:
    """The same NamedTuple with rows that Python reads quickly, also of what it holds."""
    values = []
    for value in arrays:
        if isinstance(value, tuple):
            value = interpreted(value)
        elif isinstance(value, np.ndarray):
            value = plain_rows(value)
        values.append(value)
    made: Any = type(arrays)
    return made(*values)


def run_arrays(surfaces: Sequence[SurfaceArrays], cofs: Array, frictions: Array) -> RunArrays | None:
    """What a kernel is given of the runs' own: surfaces, centres (n, 2), frictions (n,), each one for all or of each.

    Returns None if the surfaces are not of one kind and size.
    """
    kind = type(surfaces[0])
    if any(type(s) is not kind for s in surfaces):
        return None
    numbers: list[list[float]] = []
    feet: list[Array] = []
    sides: list[Array] = []
    for surface in surfaces:
        row: list[float] = []
        for value in surface:
            if not isinstance(value, np.ndarray):
                row.append(value)
            elif value.dtype in (FOOT, SIDE):
                (feet if value.dtype == FOOT else sides).append(value)
            else:
                row += value[0].tolist()
        numbers.append(row)
    if len({len(v) for v in feet}) > 1 or len({len(v) for v in sides}) > 1:
        return None
    n = max(len(surfaces), len(cofs), len(frictions))
    columns = [
        np.broadcast_to(v, (n, v.shape[1])) for v in (cofs, frictions[:, None], np.array(numbers, float))
    ]
    return RunArrays(
        records(BODIES[kind], np.concatenate(columns, axis=1)),
        np.concatenate(feet) if feet else np.zeros(0, FOOT),
        np.concatenate(sides) if sides else np.zeros(0, SIDE),
    )


def compilable(surface: LimitSurface) -> bool:
    """Whether the steps know the surface: all but collinear feet and surfaces of a user's own."""
    return isinstance(surface, Ellipsoid | Quartic) or (
        isinstance(surface, Exact) and not surface.support.collinear
    )


def surface_arrays(surface: LimitSurface) -> SurfaceArrays:
    """A limit surface about the centre of friction. Its lengths are in its unit ℓ.

    Raises:
        FlatpushError: if the steps do not know the surface (see compilable).
    """
    if isinstance(surface, Ellipsoid):
        A = surface.matrix
        ell = float(np.sqrt(np.trace(A[:2, :2]) / 2 / A[2, 2]))
        units = np.array([1.0, 1.0, ell])
        A = A * np.outer(units, units)
        A = A / (np.trace(A) / 3)
        upper = np.triu_indices(3)
        return EllipsoidArrays(ell, records(ELLIPSE, [[*A[upper], *np.linalg.inv(A)[upper]]]))
    if isinstance(surface, Quartic):
        units = surface._units
        x, y, z = units[0], units[1], units[2]
        names = TERMS.names or ()
        scale = [x ** m.count("x") * y ** m.count("y") * z ** m.count("z") for m in names]
        return QuarticArrays(float(z / x), records(TERMS, [surface.coefficients * scale]))
    if not isinstance(surface, Exact) or surface.support.collinear:
        raise FlatpushError("the compiled simulation does not know this limit surface")
    support = surface.support
    ell = float(np.sqrt(np.trace(support.covariance)))
    pressure, centre = support.pressure.scaled(1 / ell), support.centre / ell
    if isinstance(pressure, Feet):
        points, weights = pressure.points, pressure.weights
        turns = np.stack([points[:, 1], -points[:, 0], np.ones(len(points))], axis=1)
        h, W, _ = Feet(points, weights).resist(turns)  # the foot itself rests
        W[:, 2] += centre[0] * W[:, 1] - centre[1] * W[:, 0]
        feet = records(FOOT, np.column_stack([points + centre, weights, h, W]))
        return FeetArrays(ell, float(pressure.radius), feet)
    points, weights = pressure.nodes
    far = records(FOOT, np.column_stack([points + centre, weights, np.zeros((len(points), 4))]))
    x, y, radius = float(centre[0]), float(centre[1]), float(pressure.radius)
    if isinstance(pressure, Round):
        return RoundArrays(ell, radius, bool(pressure.filled), x, y, far)
    assert isinstance(pressure, Edges)
    start, e, length = _sides(pressure.vertices)
    t0, d = np.sum(start * e, axis=1), start[:, 0] * e[:, 1] - start[:, 1] * e[:, 0]
    size = float(np.sum(d * length) / 2 if pressure.filled else np.sum(length))
    shift, across = e @ centre, e[:, 1] * centre[0] - e[:, 0] * centre[1]
    sides = records(SIDE, np.column_stack([e, t0 + shift, t0 + length + shift, d + across]))
    return SidesArrays(ell, radius, bool(pressure.filled), size, x, y, sides, far)


def outline_arrays(outline: Outline) -> OutlineArrays:
    """An outline for the steps."""
    size = float(outline.size)
    if outline.is_circle:
        x, y = (float(v) for v in outline.centre)
        return OutlineArrays(True, x, y, float(outline.radius), True, size, np.zeros(0, EDGE))
    start, e, length = _sides(outline.vertices if outline.sense > 0 else outline.vertices[::-1])
    before = np.roll(e, 1, axis=0)
    convex = before[:, 0] * e[:, 1] - before[:, 1] * e[:, 0] >= 0
    edges = records(EDGE, np.column_stack([start, e, length, -e[:, 1], e[:, 0], convex]))
    return OutlineArrays(False, 0.0, 0.0, 0.0, bool(convex.all()), size, edges)


def _sides(start: Array) -> tuple[Array, Array, Array]:
    step = np.roll(start, -1, axis=0) - start
    length = np.hypot(step[:, 0], step[:, 1])
    return start, step / length[:, None], length


def records(dtype: np.dtype, rows: ArrayLike) -> Array:
    """Rows of numbers as a record array of numbers only."""
    return np.array(rows, dtype=float, order="C").view(dtype).reshape(-1)
