"""Many closed-loop runs of one push at once, compiled: a point finger on an ellipsoidal limit surface.

For other surfaces, round fingers and cameras that are late, see control.loop.closed_loop.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError
from ...geometry.pose import Array
from ..loop.limits import HandLimits
from .formulas import AxisGains
from .gains import HOLDS
from .linearisation import TrackingController
from .path_following import PathController
from .reference import PathReference
from .rollout import DFL, PATH, Ended, Loop, PointPush

OUTCOMES = ("out of time", "left the edge", "arrived")
ENDED = np.dtype([(name, np.int64 if name in ("stuck", "outcome") else float) for name in Ended._fields])


@dataclass(frozen=True, eq=False)
class ClosedLoopRuns:
    """n runs.

    Attributes:
        final: X_WO at the end, shape (n, 3).
        worst: largest distance of the flat point from its reference (path: across it), as measured, shape (n,) [m].
        stuck: ticks in which the finger stuck, shape (n,).
        slid: how far the contact moved along its edge, + to the left, shape (n,) [m].
        outcome: codes, shape (n,); OUTCOMES[code] is the word.
        object: X_WO before every tick and at the end, shape (n, ticks + 1, 3), if it was recorded; else None.
    """

    final: Array
    worst: Array
    stuck: NDArray[np.int64]
    slid: Array
    outcome: NDArray[np.int64]
    object: Array | None = None


def closed_loops(
    controller: TrackingController | PathController,
    normal: ArrayLike,
    starts: ArrayLike,
    surfaces: ArrayLike,
    duration: float,
    *,
    cofs: ArrayLike = (0.0, 0.0),
    friction: ArrayLike = 1.0,
    edge: float = np.inf,
    noise: tuple[float, float] = (0.0, 0.0),
    seed: int = 0,
    record: bool = False,
    threads: int | None = None,
) -> ClosedLoopRuns:
    """Runs a controller of a path reference at a constant speed from n poses X_WO (n, 3), within its hand's limits.

    Args:
        normal: inward, at the model's contact, in O (2,).
        surfaces: matrices A of limit surfaces about the centre of friction, (3, 3) or (n, 3, 3).
        cofs: centres of friction in O, (2,) or (n, 2). friction: () or (n,).
        edge: the contact leaves its edge after sliding this far [m].
        noise: standard deviations of the measured pose in every tick [m, rad]. seed: of it.
        record: keeps every pose.

    Raises:
        InputError: for shapes or numbers that make no sense.
    """
    from .rollout_kernel import many

    model = controller.model
    path = controller.reference if isinstance(controller, TrackingController) else controller.path
    if not isinstance(path, PathReference):
        raise InputError("compiled runs follow a path reference", value=type(path).__name__)
    if path.laws:
        raise InputError(
            "compiled runs follow a path at a constant speed, and this one has time laws", key="laws"
        )
    objects = np.ascontiguousarray(np.array(starts, dtype=float))
    if objects.ndim != 2 or objects.shape[1] != 3 or not np.all(np.isfinite(objects)):
        raise InputError("starts are poses, shape (n, 3)", value=np.shape(starts))
    n = len(objects)
    A = np.ascontiguousarray(np.array(surfaces, dtype=float).reshape(-1, 3, 3))
    centres = np.ascontiguousarray(np.array(cofs, dtype=float).reshape(-1, 2))
    mus = np.atleast_1d(np.array(friction, dtype=float))
    for name, values in (("surfaces", A), ("cofs", centres), ("friction", mus)):
        if len(values) not in (1, n) or not np.all(np.isfinite(values)):
            raise InputError(f"{name}: one for all or one for each of {n} runs", value=len(values))
    if np.any(np.linalg.eigvalsh(A) <= 0):
        raise InputError("a limit surface is a positive-definite matrix", key="surfaces")
    if not (np.isfinite(duration) and duration > 0):
        raise InputError("a duration is positive and finite", key="duration", value=duration)
    n_O = np.array(normal, dtype=float)
    if n_O.shape != (2,) or not np.all(np.isfinite(n_O)) or float(np.hypot(*n_O)) == 0:
        raise InputError("a normal is a vector of the plane", key="normal", value=normal)
    n_O = n_O / np.hypot(*n_O)
    push = PointPush(*(float(v) for v in (*model.flat_point, model.heading, model.left, model.right)),
                     *(float(v) for v in (*model.contact, *n_O)))  # fmt: skip
    if isinstance(controller, TrackingController):
        law, hold = DFL, HOLDS.index(controller.hold)
        gains = AxisGains(*(float(k) for k in (*controller.gains.kp, *controller.gains.kd)))
    else:
        law, hold = PATH, 0
        gains = AxisGains(*controller.gains, 0.0, 0.0)
    most = controller.limits
    hand = HandLimits(np.inf, np.inf, np.inf)
    if most is not None:
        # A hand whose fingertip does not turn with the object may turn as it likes.
        hand = HandLimits(most.speed, most.acceleration, most.turn_rate if model.turns else np.inf)
    ticks = round(duration * controller.rate)
    table = np.ascontiguousarray(path.table)
    loop = Loop(
        law, hold, table, float(path.speed), push, gains, float(controller.rate), ticks, float(edge), hand
    )
    noises = np.zeros((1, 1, 3))
    if max(noise) > 0:
        size = np.array([noise[0], noise[0], noise[1]])
        noises = np.random.default_rng(seed).standard_normal((n, ticks, 3)) * size
    ways = np.full((n, ticks + 1 if record else 0, 3), np.nan)
    out = np.recarray(n, dtype=ENDED)
    args = (loop, objects, A, centres, mus, np.zeros((1, 2)), noises, ways, out)
    workers = threads or os.cpu_count() or 1
    size_ = max(1, -(-n // (4 * workers)))
    if n:
        many(0, min(size_, n), *args)  # compiles, if need be, in one thread
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(lambda k: many(k, min(k + size_, n), *args), range(size_, n, size_)))
    final = np.stack([out.x, out.y, out.turn], axis=1)
    return ClosedLoopRuns(final, out.worst, out.stuck, out.along, out.outcome, ways if record else None)
