"""Writes a plan as timed poses of the pusher, for a robot."""

import os
from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..geometry import compose
from ..geometry.pose import Array
from ..problem import Plan, TransitSegment
from .atomic import write_atomically

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
    if plan.status != "solved":
        raise InputError("only a solved plan can be exported", value=plan.status, hint=plan.reason)
    base = np.array([0.0, 0.0, 0.0, 0.0] if base_frame is None else base_frame, dtype=float)
    if base.shape != (4,) or not np.isfinite(base).all():
        raise InputError("a base frame is four finite numbers, x,y,z,yaw in m and rad", value=base_frame)
    rows = _rows(plan, base)
    warning = [f"# NOT VERIFIED: {' '.join(unverified.split())}"] if unverified else []
    write_atomically(path, "\n".join([*warning, HEADER, *rows]) + "\n")
    return len(rows)


def _rows(plan: Plan, base: Array) -> list[str]:
    rows: list[str] = []
    begin, last = 0.0, -np.inf
    for number, segment in enumerate(plan.segments):
        heights = segment.height if isinstance(segment, TransitSegment) else np.zeros(len(segment.times))
        poses = compose(base[[0, 1, 3]], segment.pusher)
        for t, (x, y, yaw), height in zip(segment.times + begin, poses, heights, strict=True):
            # A segment begins where and when the last one ended.
            if t - last > 1e-9:
                # Rounded so finely that differences of rows keep the limits of speed and acceleration.
                rows.append(f"{t:.12f},{x:.15f},{y:.15f},{base[2] + height:.15f},{yaw:.15f},{number}")
                last = t
        begin += float(segment.times[-1])
    return rows
