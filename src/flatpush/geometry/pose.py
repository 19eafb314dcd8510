"""Planar poses (x, y, θ) and twists (vx, vy, ω) as float64 arrays of shape (..., 3); leading axes broadcast.

A pose X_AB is the pose of frame B in frame A; X_AB · X_BC = X_AC. A body twist is expressed in the moving frame at
its origin, so a frame that starts at X and keeps the body twist V for a time t ends at X · exp(t V).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def _columns(*columns: Array) -> Array:
    """As np.stack along a new last axis, of equal shapes, sooner."""
    together = np.empty((*columns[0].shape, len(columns)))
    for k, column in enumerate(columns):
        together[..., k] = column
    return together


def wrap_angle(angle: ArrayLike) -> Array:
    """The same angle in (-π, π] [rad].

    >>> float(wrap_angle(3 * np.pi)) == np.pi
    True
    """
    wrapped = np.remainder(np.asarray(angle, dtype=float) + np.pi, 2 * np.pi) - np.pi
    return np.where(wrapped <= -np.pi, np.pi, wrapped)


def cross(a: ArrayLike, b: ArrayLike) -> Array:
    """The scalar a × b = ax by - ay bx of plane vectors of shape (..., 2)."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def perpendicular(vector: ArrayLike) -> Array:
    """Plane vectors, shape (..., 2), turned by +90° (to their left)."""
    v = np.asarray(vector, dtype=float)
    return _columns(-v[..., 1], v[..., 0])


def rotate(angle: ArrayLike, vector: ArrayLike) -> Array:
    """The plane vectors of shape (..., 2), turned counter-clockwise by the angle [rad]."""
    v = np.asarray(vector, dtype=float)
    c, s = np.cos(angle), np.sin(angle)
    return _columns(c * v[..., 0] - s * v[..., 1], s * v[..., 0] + c * v[..., 1])


def transform(X_AB: ArrayLike, points_B: ArrayLike) -> Array:
    """Points of shape (..., 2), from frame B to frame A. One pose of shape (3,) applies to all points."""
    X = np.asarray(X_AB, dtype=float)
    return rotate(X[..., 2], points_B) + X[..., :2]


def compose(X_AB: ArrayLike, X_BC: ArrayLike) -> Array:
    """X_AC = X_AB · X_BC, all (..., 3) [m, m, rad]. Angles are added, not wrapped: a path keeps its full turns."""
    A, B = np.asarray(X_AB, dtype=float), np.asarray(X_BC, dtype=float)
    xy = A[..., :2] + rotate(A[..., 2], B[..., :2])
    return _columns(xy[..., 0], xy[..., 1], A[..., 2] + B[..., 2])


def inverse(X_AB: ArrayLike) -> Array:
    """X_BA of X_AB, both (..., 3) [m, m, rad]."""
    X = np.asarray(X_AB, dtype=float)
    xy = rotate(-X[..., 2], X[..., :2])
    return _columns(-xy[..., 0], -xy[..., 1], -X[..., 2])


def relative(X_WA: ArrayLike, X_WB: ArrayLike) -> Array:
    """X_AB, from two poses in one frame. The angle is not wrapped."""
    return compose(inverse(X_WA), X_WB)


def exp(twist: ArrayLike) -> Array:
    """The displacement after unit time with a constant body twist, both (..., 3); exact for every ω, zero included.

    >>> exp([0.0, 1.0, 0.0]).tolist()
    [0.0, 1.0, 0.0]
    """
    V = np.asarray(twist, dtype=float)
    w = V[..., 2]
    half = 0.5 * w
    # (sin w)/w and (1 - cos w)/w without cancellation; sinc is sin(πx)/(πx).
    sine, versine = np.sinc(w / np.pi), half * np.sinc(half / np.pi) ** 2
    x = sine * V[..., 0] - versine * V[..., 1]
    y = versine * V[..., 0] + sine * V[..., 1]
    return _columns(x, y, w)


def log(pose: ArrayLike) -> Array:
    """The constant body twist (..., 3) [m, rad] whose exp is the pose (..., 3); its turn is the angle, not wrapped.

    Raises:
        ValueError: if the angle is a whole number of turns other than zero and the position is not the origin
            (no constant twist leads there).
    """
    X = np.asarray(pose, dtype=float)
    w = X[..., 2]
    half = 0.5 * w
    sine = np.sinc(half / np.pi)
    if np.any((np.abs(sine) < 1e-12) & (np.hypot(X[..., 0], X[..., 1]) > 0)):
        raise ValueError("no constant twist makes a whole turn and ends elsewhere")
    cot = np.cos(half) / np.where(np.abs(sine) < 1e-12, 1.0, sine)
    x = cot * X[..., 0] + half * X[..., 1]
    y = -half * X[..., 0] + cot * X[..., 1]
    return _columns(x, y, w)


def velocity_at(twist: ArrayLike, points: ArrayLike) -> Array:
    """The velocities J_p V of points (..., 2) of a body that has the twist (..., 3), all in one frame."""
    V, p = np.asarray(twist, dtype=float), np.asarray(points, dtype=float)
    return V[..., :2] + V[..., 2:] * perpendicular(p)


def shift_twist(twist: ArrayLike, point: ArrayLike) -> Array:
    """The same motion as a twist (..., 3) about another point (..., 2) of the body: (velocity of that point, ω).

    Axes stay parallel.
    """
    V = np.asarray(twist, dtype=float)
    v = velocity_at(V, point)
    w = np.broadcast_to(V[..., 2:], (*v.shape[:-1], 1))
    return np.concatenate([v, w], axis=-1)


def pose_error(pose: ArrayLike, target: ArrayLike) -> Array:
    """pose - target, both (..., 3), with the angle wrapped [m, m, rad]."""
    difference = np.asarray(pose, dtype=float) - np.asarray(target, dtype=float)
    return np.concatenate([difference[..., :2], wrap_angle(difference[..., 2:])], axis=-1)
