"""A filter of poses: the object keeps its body twist, but for an unknown acceleration."""

from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..geometry import compose, exp, log, perpendicular, relative, wrap_angle
from ..geometry.pose import Array


@dataclass(frozen=True, eq=False)
class Track:
    """What is known of an object's motion.

    Attributes:
        stamp: at this time [s]. pose: X_WO, shape (3,). twist: body twist, shape (3,) [m/s, m/s, rad/s].
        covariance: of the error of the pose in the object's frame and of the twist, shape (6, 6).
    """

    stamp: float
    pose: Array
    twist: Array
    covariance: Array

    @property
    def pose_covariance(self) -> Array:
        """Of the pose (x, y, θ) in W, shape (3, 3)."""
        return _turned(self.covariance[:3, :3], float(self.pose[2]))


@dataclass(frozen=True)
class TwistFilter:
    """Constant body twist with white acceleration (an extended Kalman filter on poses).

    Attributes:
        acceleration, turning: standard deviations of the acceleration that is not foreseen [m/s²], [rad/s²].
        speed, spin: of the twist before anything is seen [m/s], [rad/s].

    Raises:
        InputError: for a standard deviation that is not positive.

    >>> track = TwistFilter().begin(0.0, [0.1, 0.0, 0.0], np.diag([1e-8, 1e-8, 1e-6]))
    >>> TwistFilter().at(track, 1.0).pose.tolist()
    [0.1, 0.0, 0.0]
    """

    acceleration: float = 0.3
    turning: float = 6.0
    speed: float = 0.05
    spin: float = 1.0

    def __post_init__(self) -> None:
        for name in ("acceleration", "turning", "speed", "spin"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError("a standard deviation is positive", key=name, value=value)

    def begin(self, stamp: float, pose: Array | list[float], covariance: Array) -> Track:
        """The track from a first pose X_WO (3,) with its covariance in W (3, 3), at the time `stamp` [s]."""
        start = np.asarray(pose, dtype=float)
        whole = np.zeros((6, 6))
        whole[:3, :3] = _turned(covariance, -float(start[2]))
        whole[3:, 3:] = np.diag([self.speed**2, self.speed**2, self.spin**2])
        return Track(stamp, start, np.zeros(3), whole)

    def at(self, track: Track, time: float) -> Track:
        """The track at another time [s]: later, to make up for latency, or a little earlier."""
        dt = time - track.stamp
        moved = dt * track.twist
        carry = np.eye(6)
        carry[:3, :3] = _adjoint(exp(-moved))
        carry[:3, 3:] = dt * (np.eye(3) - 0.5 * _bracket(moved))  # the slope of exp, to second order
        spread = np.array([self.acceleration, self.acceleration, self.turning])
        push = np.concatenate([0.5 * dt**2 * np.diag(spread), dt * np.diag(spread)])
        return Track(
            time,
            compose(track.pose, exp(moved)),
            track.twist,
            carry @ track.covariance @ carry.T + push @ push.T,
        )

    def distance(self, track: Track, pose: Array, covariance: Array) -> float:
        """Squared distance of a pose X_WO (3,) from the track at its time, in its standard deviations; of three degrees
        of freedom. covariance: of the pose in W (3, 3)."""
        off, spread = self._off(track, pose, covariance)
        return float(off @ np.linalg.solve(spread, off))

    def after(self, track: Track, pose: Array, covariance: Array) -> Track:
        """The track after a pose X_WO (3,) that was seen at its time, with its covariance in W (3, 3)."""
        off, spread = self._off(track, pose, covariance)
        gain = np.linalg.solve(spread, track.covariance[:3]).T
        step = gain @ off
        keep = np.eye(6)
        keep[:, :3] -= gain
        noise = _turned(covariance, -float(track.pose[2]))
        return replace(
            track,
            pose=compose(track.pose, exp(step[:3])),
            twist=track.twist + step[3:],
            covariance=keep @ track.covariance @ keep.T + gain @ noise @ gain.T,
        )

    def _off(self, track: Track, pose: Array, covariance: Array) -> tuple[Array, Array]:
        off = relative(track.pose, pose)
        off[2] = wrap_angle(off[2])
        return log(off), track.covariance[:3, :3] + _turned(covariance, -float(track.pose[2]))


def _turned(covariance: Array, angle: float) -> Array:
    """A covariance of (x, y, θ) in axes that are turned back by an angle [rad]."""
    R = np.eye(3)
    R[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return np.asarray(R @ covariance @ R.T)


def _adjoint(pose: Array) -> Array:
    """Of a pose X_AB: a body twist in B, in A."""
    found = np.eye(3)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    found[:2, :2] = [[c, -s], [s, c]]
    found[:2, 2] = -perpendicular(pose[:2])
    return found


def _bracket(twist: Array) -> Array:
    """The matrix of the Lie bracket of a twist (vx, vy, ω) with another."""
    vx, vy, w = twist
    return np.array([[0, -w, vy], [w, 0, -vx], [0, 0, 0]])
