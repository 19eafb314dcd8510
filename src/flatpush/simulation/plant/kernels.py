"""The plant's runs, compiled: for each kind of limit surface when it is first needed."""

from ...compiled import kernel
from ...formulas import by_type, formula
from ...geometry.pose import Array
from .arrays import (
    BODIES,
    POSE,
    RUN,
    SCRATCH,
    SEEN,
    EllipsoidArrays,
    FeetArrays,
    OutlineArrays,
    QuarticArrays,
    RoundArrays,
    Rows,
    Scratch,
    Setting,
    SidesArrays,
)
from .contacts import push_out
from .steps import follow


@formula
def _ellipsoid(bodies: Rows, feet: Rows, sides: Rows) -> EllipsoidArrays:
    return EllipsoidArrays(bodies[0].unit, bodies)


@formula
def _quartic(bodies: Rows, feet: Rows, sides: Rows) -> QuarticArrays:
    return QuarticArrays(bodies[0].unit, bodies)


@formula
def _feet(bodies: Rows, feet: Rows, sides: Rows) -> FeetArrays:
    return FeetArrays(bodies[0].unit, bodies[0].radius, feet)


@formula
def _sides(bodies: Rows, feet: Rows, sides: Rows) -> SidesArrays:
    b = bodies[0]
    return SidesArrays(b.unit, b.radius, b.filled != 0.0, b.size, b.x, b.y, sides, feet)


@formula
def _round(bodies: Rows, feet: Rows, sides: Rows) -> RoundArrays:
    b = bodies[0]
    return RoundArrays(b.unit, b.radius, b.filled != 0.0, b.x, b.y, feet)


_WAYS = {
    EllipsoidArrays: _ellipsoid,
    QuarticArrays: _quartic,
    FeetArrays: _feet,
    SidesArrays: _sides,
    RoundArrays: _round,
}
_surface = by_type({BODIES[kind]: way for kind, way in _WAYS.items()})


@kernel(lent=True)
def many(
    course: Rows,
    bodies: Rows,
    feet: Rows,
    sides: Rows,
    outlines: Rows,
    edges: Rows,
    fingers: Rows,
    runs_: Array,
    poses_: Array,
    out_: Array,
    seen_: Array,
    scratch_: Array,
) -> None:
    """steps.follow for the RUN rows `runs_` that the COURSE row says, and writes how they ended.

    Bodies, surfaces and the hands' poses are one for all or one for each run; rows of `out_` and `seen_` follow one
    another, run by run. Of `course`, `outlines` (OUTLINE) and `scratch_` (SCRATCH) there is one row. What differs from
    call to call comes as plain numbers (in a row), which are passed more quickly than records.
    """
    runs, poses, out, seen = runs_.view(RUN), poses_.view(POSE), out_.view(POSE), seen_.view(SEEN)
    how, thing, room = course[0], outlines[0], scratch_.view(SCRATCH)[0]
    outline = OutlineArrays(
        thing.circle != 0, thing.x, thing.y, thing.radius, thing.convex != 0, thing.size, edges
    )
    space = Scratch(room.contacts, room.rays, room.planes, room.q, room.hands, room.steps, room.now)
    length, look = how.hands * how.number, how.rows * len(fingers)
    nf, ns = len(feet) // how.surfaces, len(sides) // how.surfaces
    for r in range(how.first, how.last):
        b, k = (r if len(bodies) > 1 else 0), (r if how.surfaces > 1 else 0)
        body = bodies[b]
        surface = _surface(bodies[b : b + 1], feet[k * nf : (k + 1) * nf], sides[k * ns : (k + 1) * ns])
        setting = Setting(surface, body.cof_x, body.cof_y, outline, body.friction, thing.tip, fingers)
        way = poses[r * length : (r + 1) * length] if len(poses) > length else poses
        if how.push_out != 0:
            push_out(setting, runs[r], way[: how.hands], space)
        to, there = out[r * how.rows : (r + 1) * how.rows], seen[r * look : (r + 1) * look]
        runs[r].status, runs[r].reached = follow(
            setting, runs[r], way, how.hands, how.begin, how.kind, to, there, space
        )
