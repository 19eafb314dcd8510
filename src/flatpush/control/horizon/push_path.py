"""The path of an object through one push, as it was found among things, and the law that keeps to it."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...geometry import compose, exp
from ...geometry.pose import Array
from ...planning.path import Path
from ..laws.formulas import wrapped
from ..laws.steering_model import SteeringModel

# Between the poses that are kept of a path, along the path of the flat point [m].
STEP = 0.001
# Both poles of the law that keeps to a path, by the turning radius: an error is gone after about one radius.
POLE = 2.0


class Progress(NamedTuple):
    """Where an object is on its path: the pose it has passed, what is left of the path [m], how far it is off to the
    left [m], the angle off its heading [rad], and the turn of the path there [1/m]."""

    passed: int
    left: float
    off: float
    skew: float
    turn: float

    def curvature(self, radius: float) -> float:
        """The turn per length that leads back to the path [1/m]: in arc length e'' + 2 p e' + p² e = 0.

        Args:
            radius: by which it comes back [m].
        """
        p = POLE / radius
        ahead = self.turn * math.cos(self.skew) / max(0.2, 1 - self.turn * self.off)
        return ahead - 2 * p * math.sin(self.skew) - p * p * self.off


@dataclass(frozen=True, eq=False)
class PushPath:
    """Poses of the object along one push.

    Attributes:
        poses: X_WO, shape (n, 3). left: what is then left of the flat path, shape (n,) [m].
        margin: beyond the clearance that it keeps [m].
        last: whether it ends at the goal.
    """

    poses: Array
    left: Array
    margin: float
    last: bool

    @classmethod
    def of(cls, path: Path, margin: float) -> "PushPath":
        """The first push of a path."""
        push, poses, steps = path.pieces[0][0], [path.start[None]], [np.zeros(0)]
        for k, (which, letter, amount) in enumerate(path.pieces):
            if which != push:
                break
            length = float(path.fleet.rates[push, letter]) * amount
            count = max(1, math.ceil(length / STEP))
            shares = np.arange(1, count + 1)[:, None] / count
            poses.append(compose(path.poses[k], exp(shares * path.step(which, letter, amount))))
            steps.append(np.full(count, length / count))
        along = np.concatenate([[0.0], np.cumsum(np.concatenate(steps))])
        return cls(np.concatenate(poses), along[-1] - along, margin, len(path.pushes) == 1)

    def progress(self, model: SteeringModel, pose: Array, passed: int) -> Progress:
        """Of an object at X_WO that had passed a pose of the path before."""
        x, y, heading = model.flat_of(pose)
        most = len(self.poses) - 2
        k = min(passed, most)
        while True:
            ax, ay, begin = model.flat_of(self.poses[k])
            bx, by, end = model.flat_of(self.poses[k + 1])
            length = max(math.hypot(bx - ax, by - ay), 1e-12)
            tx, ty = (bx - ax) / length, (by - ay) / length
            on = (x - ax) * tx + (y - ay) * ty
            if on < length or k == most:
                break
            k += 1
        bent = wrapped(end - begin)
        share = min(max(on / length, 0.0), 1.0)
        return Progress(
            k,
            float(self.left[k]) - on,
            tx * (y - ay) - ty * (x - ax),
            wrapped(heading - begin - share * bent),
            bent / length,
        )
