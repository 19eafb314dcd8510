"""Writes a plan as timed poses of the pusher, for a robot."""

import os
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..geometry import compose
from ..geometry.pose import Array
from ..problem import Plan, TransitSegment
from .atomic import write_atomically

# Straight moves of a program may miss samples by so much [m], [rad]; of a turn the way is LEVER times as long [m].
FAR, TURN, LEVER = 5e-5, 1e-3, 0.03
HEADER = "t [s],x [m],y [m],z [m],yaw [rad],segment"


def export_csv(
    plan: Plan,
    path: str | os.PathLike[str],
    base_frame: Sequence[float] | None = None,
    *,
    unverified: str = "",
) -> int:
    """Writes the poses of the pusher over time, one row each: t, x, y, z, yaw and the number of the segment.

    The pose is that of the frame E (midway between the fingertips, x along the push), its z the height of the
    tips above the table plus that of the base frame. Times run on from segment to segment and increase from
    row to row; yaw is not wrapped, so that straight interpolation is right.

    Args:
        plan: a solved plan.
        path: of the CSV file, which appears whole or not at all.
        base_frame: the pose (x, y, z, yaw) of the table frame W in the robot's base frame [m, rad]; W itself
            if None.
        unverified: why the plan is not verified; it stands in a line before the header, after "# NOT VERIFIED".

    Returns:
        The number of rows.

    Raises:
        InputError: if there is no plan, the base frame is not four finite numbers, or the file cannot be
            written.
    """
    base = _base(plan, base_frame)
    rows = []
    for t, (x, y, height, yaw), number in _samples(plan):
        x, y, yaw = compose(base[[0, 1, 3]], [x, y, yaw])
        # Rounded so finely that differences of rows keep the limits of speed and acceleration.
        rows.append(f"{t:.12f},{x:.15f},{y:.15f},{base[2] + height:.15f},{yaw:.15f},{number}")
    warning = [f"# {_warning(unverified)}"] if unverified else []
    write_atomically(path, "\n".join([*warning, HEADER, *rows]) + "\n")
    return len(rows)


def export_rapid(
    plan: Plan,
    path: str | os.PathLike[str],
    base_frame: Sequence[float] | None = None,
    *,
    unverified: str = "",
) -> int:
    """Writes a RAPID module for ABB controllers: a linear move to every pose that straight ones between would miss.

    The poses stand in a work object, whose frame is the base frame; the tool, whose z points down and whose x goes
    along the push, is to be filled in. Every move takes the time that the plan has for it; within a move the controller
    accelerates as it likes, which a push does not notice. Arguments and errors are those of export_csv: base_frame is
    the pose of the table in the robot's base (x, y, z, yaw) [m, rad].

    Returns:
        The number of moves.
    """
    base = _base(plan, base_frame)
    samples = list(_samples(plan))
    times, poses = np.array([t for t, *_ in samples]), np.array([pose for _, pose, _ in samples])
    ends = [n != after for (*_, n), (*_, after) in pairwise(samples)] + [True]
    moves, last = [], 0
    for k in _needed(poses, np.flatnonzero(ends)):
        lasts = f"\\T:={round(times[k], 4) - round(times[last], 4):.4f}, {'fine' if ends[k] else 'z0'}"
        moves.append(f"    MoveL {_robtarget(poses[k])}, v100 {lasts}, flatpush_tool \\WObj:=flatpush_table;")
        last = k
    x, y, z = 1000 * base[:3]
    c, s = np.cos(base[3] / 2), np.sin(base[3] / 2)
    name = plan.scene.object.name.encode("ascii", "replace").decode().replace("\n", " ")
    lines = [
        "MODULE flatpush",
        *([f"  ! {_warning(unverified).encode('ascii', 'replace').decode()}"] if unverified else []),
        f"  ! {name[:60]}: {len(plan.on_table)} pushes, {times[-1]:.1f} s; lengths in mm",
        "  ! Midway between the fingertips, z down, x along the push: set it to your tool.",
        "  PERS tooldata flatpush_tool:=[TRUE,[[0,0,100],[1,0,0,0]],[0.5,[0,0,50],[1,0,0,0],0,0,0]];",
        f'  PERS wobjdata flatpush_table:=[FALSE,TRUE,"",[[{x:.4f},{y:.4f},{z:.4f}],[{c:.8f},0,0,{s:.8f}]],'
        "[[0,0,0],[1,0,0,0]]];",
        "  PROC flatpush_run()",
        "    ConfL \\Off;",
        f"    MoveL {_robtarget(poses[0] + [0, 0, plan.scene.pusher.lift, 0])}, v50, fine, flatpush_tool"
        " \\WObj:=flatpush_table;",
        f"    MoveL {_robtarget(poses[0])}, v20, fine, flatpush_tool \\WObj:=flatpush_table;",
        *moves,
        "  ENDPROC",
        "ENDMODULE",
    ]
    write_atomically(path, "\n".join(lines) + "\n")
    return len(moves)


def _base(plan: Plan, base_frame: Sequence[float] | None) -> Array:
    """Pose (x, y, z, yaw) of the table in the robot's base, of a plan that can be exported."""
    if plan.status != "solved":
        raise InputError("only a solved plan can be exported", value=plan.status, hint=plan.reason)
    base = np.array([0.0, 0.0, 0.0, 0.0] if base_frame is None else base_frame, dtype=float)
    if base.shape != (4,) or not np.isfinite(base).all():
        raise InputError("a base frame is four finite numbers, x,y,z,yaw in m and rad", value=base_frame)
    return base


def _warning(unverified: str) -> str:
    return f"NOT VERIFIED: {' '.join(unverified.split())}"


def _samples(plan: Plan) -> Iterator[tuple[float, Array, int]]:
    """Times that run on, poses (x, y, height, yaw) of E in W, and numbers of the segments."""
    begin, last = 0.0, -np.inf
    for number, segment in enumerate(plan.segments):
        heights = segment.height if isinstance(segment, TransitSegment) else np.zeros(len(segment.times))
        for t, (x, y, yaw), height in zip(segment.times + begin, segment.pusher, heights, strict=True):
            # A segment begins where and when the last one ended.
            if t - last > 1e-9:
                yield float(t), np.array([x, y, height, yaw]), number
                last = t
        begin += float(segment.times[-1])


def _needed(poses: Array, kept: NDArray[np.intp]) -> list[int]:
    """Indices, without the first, of the samples that are kept, and of those that straight moves between them would
    miss by more than FAR or TURN (Douglas and Peucker).
    """
    steps = np.abs(np.diff(poses, axis=0))
    way = np.append(0.0, np.cumsum(np.linalg.norm(steps[:, :3], axis=1) + LEVER * steps[:, 3]))
    found = {int(k) for k in kept}
    spans = list(pairwise(sorted({0, *found})))
    while spans:
        a, b = spans.pop()
        share = (way[a + 1 : b] - way[a]) / max(way[b] - way[a], 1e-12)
        off = poses[a + 1 : b] - poses[a] - share[:, None] * (poses[b] - poses[a])
        miss = np.maximum(np.linalg.norm(off[:, :3], axis=1) / FAR, np.abs(off[:, 3]) / TURN)
        if len(miss) and miss.max() > 1:
            k = a + 1 + int(np.argmax(miss))
            found.add(k)
            spans += [(a, k), (k, b)]
    return sorted(found - {0})


def _robtarget(pose: Array) -> str:
    """A pose of E as RAPID has it; Rz(yaw) Rx(pi) = (0, cos yaw/2, sin yaw/2, 0)."""
    x, y, z = 1000 * pose[:3]
    c, s = np.cos(pose[3] / 2), np.sin(pose[3] / 2)
    return f"[[{x:.4f},{y:.4f},{z:.4f}],[0,{c:.8f},{s:.8f},0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
