"""The plant's runs, compiled: for each kind of limit surface when it is first needed."""

from typing import Any

from ...compiled import kernel
from ...formulas import by_type, formula
from .arrays import (
    Course,
    EllipsoidArrays,
    FeetArrays,
    ManySettings,
    QuarticArrays,
    RoundArrays,
    Rows,
    Scratch,
    Setting,
    SidesArrays,
)
from .steps import follow, push_out


@formula
def _ellipsoid(surfaces: EllipsoidArrays, r: int) -> EllipsoidArrays:
    return EllipsoidArrays(surfaces.unit[r], surfaces.ellipse[r : r + 1])


@formula
def _quartic(surfaces: QuarticArrays, r: int) -> QuarticArrays:
    return QuarticArrays(surfaces.unit[r], surfaces.terms[r : r + 1])


@formula
def _feet(surfaces: FeetArrays, r: int) -> FeetArrays:
    n = len(surfaces.feet) // len(surfaces.unit)
    return FeetArrays(surfaces.unit[r], surfaces.radius[r], surfaces.feet[r * n : r * n + n])


@formula
def _sides(surfaces: SidesArrays, r: int) -> SidesArrays:
    s = surfaces
    n, m = len(s.sides) // len(s.unit), len(s.nodes) // len(s.unit)
    sides, nodes = s.sides[r * n : r * n + n], s.nodes[r * m : r * m + m]
    return SidesArrays(s.unit[r], s.radius[r], s.filled[r], s.size[r], s.x[r], s.y[r], sides, nodes)


@formula
def _round(surfaces: RoundArrays, r: int) -> RoundArrays:
    s = surfaces
    n = len(s.nodes) // len(s.unit)
    return RoundArrays(s.unit[r], s.radius[r], s.filled[r], s.x[r], s.y[r], s.nodes[r * n : r * n + n])


surface_of_run = by_type(
    {
        EllipsoidArrays: _ellipsoid,
        QuarticArrays: _quartic,
        FeetArrays: _feet,
        SidesArrays: _sides,
        RoundArrays: _round,
    }
)


@kernel(lent=True)
def many(
    first: int,
    last: int,
    settings: ManySettings,
    starts: Rows,
    poses: Rows,
    course: Course,
    out: Rows,
    seen: Rows,
    status: Any,
    reached: Any,
    scratch: Scratch,
) -> None:
    """steps.follow for the runs first to last, from the poses X_WO in `starts`.

    Surfaces, centres, frictions and the hands' poses are one for all or one for each run; rows of `out` and `seen`
    follow one another, run by run.
    """
    surfaces, cofs, mus = settings.surfaces, settings.cofs, settings.frictions
    fingers, length = settings.fingers, course.hands * course.number
    for r in range(first, last):
        surface = surface_of_run(surfaces, r if len(surfaces.unit) > 1 else 0)
        cof = cofs[r if len(cofs) > 1 else 0]
        mu = mus[r if len(mus) > 1 else 0]
        setting = Setting(surface, cof.x, cof.y, settings.outline, mu, settings.radius, fingers)
        way = poses[r * length : r * length + length] if len(poses) > length else poses
        if course.push_out:
            push_out(setting, starts[r], way[: course.hands], scratch)
        to, look = out[r * course.rows : (r + 1) * course.rows], course.rows * len(fingers)
        there = seen[r * look : (r + 1) * look]
        status[r], reached[r] = follow(setting, starts[r], way, course.hands, course.kind, to, there, scratch)
