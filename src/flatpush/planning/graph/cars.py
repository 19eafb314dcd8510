"""The cars of a fleet as numbers for the tree: frames of poses, and constants that bound the cost of a path from below.

The frame of a push is its axle: origin at the midpoint of the turning centres, in units of half their distance
R, heading across their line. What a path costs at least follows from one body point P on the line of the
centres, placed so that both turns move it ahead at the same speed per cost:

* straight or turning, a metre of P costs at least WAY / R; a radian costs at least TURNING;
* a path whose displacement has the direction ψ must turn. Let α and β be the angles between ψ and the heading
  at start and goal, and f(x) = x - σ sin x, what a radian of turning costs beyond the progress that it makes,
  with σ ≤ 1 the progress per cost in a turn over that ahead. Across ψ the displacement is zero, so somewhere
  the heading is within the tilt of the straight direction of ψ or of its opposite; and there is progress, so
  somewhere it is within a right angle and the tilt of ψ. Hence a path costs at least |ΔP| WAY / R and TURNING
  times the least of
      ahead: f(α) - f(tilt) + f(β) - f(tilt)
      back:  f(π - tilt) - f(α) + f(π - tilt) - f(β) + 2 (min(f(α), f(β)) - f(π/2 + tilt))
  where no difference counts that is negative;
* close to each other it matters more that all turns together are at least α + β - 4 tilt (Fenchel: with the
  chord the path is a closed curve);
* in particular, turning by δ costs at least TURNING (δ - 2 sin(δ/2)) beyond the progress, whatever the direction;
* with a time law an arc that takes c at full speed takes c + κ, or 2 √(cκ) if c < κ. That is concave and zero
at zero, so a
  path takes at least as long as one arc of its cost would.
"""

import numpy as np

from ...geometry import compose
from ...geometry.pose import Array
from ...steering.fleet import Fleet

# Columns of car_table.
UNIT, TILT_C, TILT_S, TURN_L, AHEAD, TURN_R, LATE_L, LATE_S, LATE_R = range(9)
WAY, OFFSET, TURNING, SIGMA, TILT, FALL, SIDE, RISE, LATE, COLUMNS = range(9, 19)


def axle_frames(fleet: Fleet, poses: Array) -> Array:
    """For poses X_WO of shape (n, 3), shape (k, 5, n): x, y in units of R, cosine, sine and heading in [0, 2π)."""
    across = fleet.left - fleet.right
    axles = np.column_stack([fleet.flat_point, np.arctan2(across[:, 1], across[:, 0]) - 0.5 * np.pi])
    X = compose(poses[None], axles[:, None])
    heading = np.remainder(X[..., 2], 2 * np.pi)
    heading = np.where(heading < 2 * np.pi, heading, 0.0)
    unit = fleet.radius[:, None]
    frames = [X[..., 0] / unit, X[..., 1] / unit, np.cos(heading), np.sin(heading), heading]
    return np.ascontiguousarray(np.stack(frames, axis=1))


def car_table(fleet: Fleet) -> Array:
    """One row per push, shape (k, COLUMNS); costs per radian and per R ahead, at full speed."""
    k = fleet.size
    R = fleet.radius
    timed = np.isfinite(fleet.speeds)
    rates = np.where(timed, fleet.rates / np.where(timed, fleet.speeds, 1.0), fleet.rates)
    late = np.where(timed, np.where(timed, fleet.speeds, 0.0) / fleet.accelerations, 0.0)
    across = fleet.left - fleet.right
    ahead = np.column_stack([across[:, 1], -across[:, 0]]) / (2 * R[:, None])
    straight = fleet.direction / np.linalg.norm(fleet.direction, axis=1)[:, None]

    table = np.zeros((k, COLUMNS))
    table[:, UNIT] = R
    table[:, TILT_C] = np.einsum("ij,ij->i", ahead, straight)
    table[:, TILT_S] = ahead[:, 0] * straight[:, 1] - ahead[:, 1] * straight[:, 0]
    table[:, TURN_L], table[:, AHEAD], table[:, TURN_R] = rates[:, 0], rates[:, 1] * R, rates[:, 2]
    table[:, LATE_L], table[:, LATE_S], table[:, LATE_R] = late.T

    both = rates[:, 0] + rates[:, 2]
    table[:, WAY] = np.minimum(table[:, AHEAD], 0.5 * both)
    table[:, OFFSET] = np.where(both > 0, (rates[:, 2] - rates[:, 0]) / np.where(both > 0, both, 1.0), 0.0)
    table[:, TURNING] = np.minimum(rates[:, 0], rates[:, 2])
    table[:, SIGMA] = np.where(both > 0, 2 * table[:, WAY] / np.where(both > 0, both, 1.0), 0.0)
    tilt = np.arctan2(np.abs(table[:, TILT_S]), table[:, TILT_C])
    table[:, TILT] = tilt
    table[:, FALL] = tilt - table[:, SIGMA] * np.sin(tilt)
    table[:, SIDE] = 0.5 * np.pi + tilt - table[:, SIGMA] * np.cos(tilt)
    table[:, RISE] = np.pi - tilt - table[:, SIGMA] * np.sin(tilt)
    table[:, LATE] = np.min(late, axis=1)
    return table


def has_time_law(fleet: Fleet) -> bool:
    """Whether some arc takes longer than at full speed."""
    return bool(np.any(np.isfinite(fleet.speeds) & np.isfinite(fleet.accelerations)))
