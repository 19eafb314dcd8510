"""How near a body comes to obstacles and bounds at a pose or along a path, and where."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..pose import Array, compose, exp
from .body import Body
from .world import World


@dataclass(frozen=True)
class Clearance:
    """The least clearance along a path of constant body twists.

    Attributes:
        distance: [m]; 0 where something touches. Negative where the body overlaps an obstacle or leaves the bounds:
            minus how far it is beyond a side or two circles overlap, minus infinity inside a polygon or through its
            edges, where no depth is computed. What crosses by less than a nanometre touches.
        piece: number of the piece of the path with the least clearance, from 0.
        fraction: of that piece, 0 to 1, where it is met.
        obstacle: its number, or -1 for the bounds, or -2 if there is nothing near.
    """

    distance: float
    piece: int
    fraction: float
    obstacle: int


def pose_clearance(world: World, body: Body, pose: ArrayLike, reach: float = np.inf) -> float:
    """Clearance of a body at a pose X_WO [m], at most `reach`; signs as in Clearance.distance.

    >>> from flatpush.geometry import Outline
    >>> world = World.of((0, 0, 10, 10), [Outline.polygon([(4, 4), (6, 4), (6, 6), (4, 6)])])
    >>> body = Body.of(Outline.circle(0.5))
    >>> [pose_clearance(world, body, (x, 5, 0)) for x in (1, 3, 3.5, 5)]
    [0.5, 0.5, 0.0, -inf]
    """
    from .kernels import pose_gap

    if world.empty:
        return reach
    X = np.array(pose, dtype=float)
    return float(pose_gap(world.arrays, body.arrays, X, _finite(world, body, X, reach), -np.inf))


def path_clearance(
    world: World, body: Body, start: ArrayLike, steps: ArrayLike, reach: float = np.inf, need: float = -np.inf
) -> Clearance:
    """The least clearance along a path, exact between its ends: no obstacle is thin enough to be jumped.

    Every point of the body runs on an arc about the centre of the turn or on a straight line, and as seen from the
    body so does every obstacle; what is nearest is a corner and an edge, two corners or a circle, for which the least
    distance along an arc is closed form. That nothing meets on the way and nothing overlaps at the start is all there
    is to a path without collision.

    Args:
        start: pose X_WO, shape (3,).
        steps: displacements as body twists, the pose after piece i being that before · exp(steps[i]); shape (n, 3).
            Of no more than a full turn each.
        reach: clearances beyond it are not told apart [m].
        need: the search ends at the first piece with less than this [m].

    A clearance equal to what is asked for keeps it: touching counts as clearance 0, and is free where 0 is asked for.
    """
    from .kernels import pose_gap, twist_gap

    if world.empty:
        return Clearance(reach, 0, 0.0, -2)
    arrays = world.arrays, body.arrays
    X, twists = np.array(start, dtype=float), np.array(steps, dtype=float).reshape(-1, 3)
    far = _finite(world, body, np.concatenate([X[None], twists]), reach)
    best = float(pose_gap(*arrays, X, far, -np.inf))
    at, from_pose = 0, X
    for i, step in enumerate(twists):
        if best < need or best == -np.inf:
            break
        gap = float(twist_gap(*arrays, X, step, far, -np.inf))
        if gap < best:
            best, at, from_pose = gap, i, X
        X = compose(X, exp(step))
    from .plain import place

    step = twists[at] if len(twists) else np.zeros(3)
    fraction, obstacle = place(world, body, from_pose, step, best, far)
    return Clearance(best, at, fraction, obstacle)


def _finite(world: World, body: Body, motions: Array, reach: float) -> float:
    """A finite reach, longer than any distance at a pose (3,), or on the way of a pose and twists (n, 3)."""
    if np.isfinite(reach):
        return reach
    values = [1.0, *np.abs(world.boxes).ravel(), *np.abs(world.bounds[np.isfinite(world.bounds)])]
    B = body.arrays
    own = B.reach + float(np.hypot(B.x, B.y))
    return 3.0 * float(np.max(values) + own + np.sum(np.hypot(motions[..., 0], motions[..., 1])))
