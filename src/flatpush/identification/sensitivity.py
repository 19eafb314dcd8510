"""How the end of a pushed stretch depends on loads, places and friction: the equations of motion, differentiated.

While one finger pushes at p, the twist V (body frame, per step) satisfies, with the wrench W(V) of the table,
    stick: J_p V = u, k · W = 0           slide: n · (J_p V - u) = 0, k · W = 0, (t ∓ μ n) · W_xy = 0,
k = (p_y, -p_x, 1): the finger has no moment about its contact. Their derivatives give dV for any change, and changes of
the pose ε (body frame) add up along the way: ε' = dV + [ε, V].
"""

from typing import NamedTuple

import numpy as np

from ..geometry import cross, log, perpendicular, relative, rotate
from ..geometry.pose import Array
from ..simulation.plant.codes import LEFT, STICKING
from .pressure import Spread

# A foot moves at least so fast, by the fastest point: one under the rotation centre has no derivative.
_SLOW = 1e-4


class Sensitivity(NamedTuple):
    """Of the end poses of n stretches, in their own frames.

    Attributes:
        numbers: by the pressure's numbers and log μ, (n, 3, p + 1). start: by the pose at the start, (n, 3, 3).
    """

    numbers: Array
    start: Array


class Way(NamedTuple):
    """Rolled-out stretches: n of them, m places of the finger.

    Attributes:
        poses: X_WO (n, m, 3). modes: before each place (n, m). points: contacts in O (n, m, 2).
        normals: inward, of each stretch and place (n, m, 2). tips: in W (n, m, 2).
    """

    poses: Array
    modes: np.ndarray
    points: Array
    normals: Array
    tips: Array


def sensitivity(way: Way, spread: Spread, friction: float) -> Sensitivity:
    """Derivatives along stretches that were rolled out."""
    n, m = way.poses.shape[:2]
    by = np.zeros((n, 3, spread.by_loads.shape[1] + 1))
    start = np.tile(np.eye(3), (n, 1, 1))
    for k in range(m - 1):
        V, here, numbers = _step(way, k, spread, friction)
        bracket = _bracket(V)
        by = by + here @ by + bracket @ by + numbers
        start = start + here @ start + bracket @ start
    return Sensitivity(by, start)


def _bracket(V: Array) -> Array:
    """The matrix of ε ↦ [ε, V], shape (n, 3, 3)."""
    M = np.zeros((len(V), 3, 3))
    M[:, 0, 1], M[:, 1, 0] = V[:, 2], -V[:, 2]
    M[:, :2, 2] = perpendicular(V[:, :2])
    return M


def _step(way: Way, k: int, spread: Spread, friction: float) -> tuple[Array, Array, Array]:
    """V of a step, its derivative by the pose (n, 3, 3) and by the numbers (n, 3, p + 1)."""
    step = relative(way.poses[:, k], way.poses[:, k + 1])
    V = log(np.column_stack([step[:, :2], np.arctan2(np.sin(step[:, 2]), np.cos(step[:, 2]))]))
    p = 0.5 * (way.points[:, k] + way.points[:, k + 1])
    normal = way.normals[:, k + 1]
    middle = 0.5 * (way.poses[:, k, 2] + way.poses[:, k + 1, 2])
    moved = way.tips[:, k + 1] - way.tips[:, k]
    u = rotate(-middle, moved)
    r = spread.places
    a = V[:, None, :2] + V[:, None, 2:] * perpendicular(r)  # (n, feet, 2)
    speed = np.linalg.norm(a, axis=2)
    speed = np.hypot(speed, _SLOW * speed.max(axis=1, keepdims=True) + 1e-15)
    unit = a / speed[:, :, None]
    w = spread.loads
    force = np.einsum("k,nkd->nd", w, unit)
    across = perpendicular(unit)
    c = w / speed  # ∂û/∂a = (across acrossᵀ + still I) / speed
    still = 1 - np.sum(unit * unit, axis=2)
    arm = np.concatenate([across, np.einsum("nkd,kd->nk", across, perpendicular(r))[..., None]], axis=2)
    H = np.einsum("nk,nki,nkj->nij", c, arm, arm)  # ∂W/∂V
    held = np.zeros((len(r), 2, 3))
    held[:, 0, 0] = held[:, 1, 1] = 1.0
    held[:, :, 2] = perpendicular(r)
    H += np.einsum("nk,kdi,kdj->nij", c * still, held, held)
    moment = cross(r[None] - p[:, None], unit)  # of each foot about the contact, (n, feet)
    tangent = perpendicular(normal)
    about = np.column_stack([p[:, 1], -p[:, 0], np.ones(len(p))])
    J = np.zeros((len(p), 2, 3))
    J[:, 0, 0] = J[:, 1, 1] = 1.0
    J[:, :, 2] = perpendicular(p)
    stick = way.modes[:, k + 1] == STICKING
    side = np.where(way.modes[:, k + 1] == LEFT, 1.0, -1.0)
    edge = tangent - (side * friction)[:, None] * normal
    G = np.zeros((len(p), 3, 3))
    G[:, 0] = np.where(stick[:, None], J[:, 0], np.einsum("nd,ndi->ni", normal, J))
    G[:, 1] = np.where(stick[:, None], J[:, 1], np.einsum("nd,ndi->ni", edge, H[:, :2]))
    G[:, 2] = np.einsum("ni,nij->nj", about, H)
    # By the numbers.
    P = spread.by_loads.shape[1]
    right = np.zeros((len(p), 3, P + 1))
    right[:, 2, :P] = moment @ spread.by_loads
    slides = np.einsum("nkd,nd->nk", unit, edge) @ spread.by_loads
    if spread.by_places is not None:
        turn = (
            V[:, 2, None, None, None] * perpendicular(np.moveaxis(spread.by_places, 1, -1))[None]
        )  # (1, k, p, 2)
        along = np.einsum("nkd,nkpd->nkp", across, turn)
        change = c[:, :, None, None] * (
            along[..., None] * across[:, :, None] + still[:, :, None, None] * turn
        )
        moments = cross(r[None, :, None] - p[:, None, None], change)
        own = w[:, None] * (
            spread.by_places[:, 0][None] * unit[:, :, 1:] - spread.by_places[:, 1][None] * unit[:, :, :1]
        )
        right[:, 2, :P] += moments.sum(axis=1) + own.sum(axis=1)
        slides += np.einsum("nkpd,nd->np", change, edge)
    right[:, 1, :P] = np.where(stick[:, None], 0.0, slides)
    right[:, 1, P] = np.where(stick, 0.0, -side * friction * np.sum(normal * force, axis=1))
    # By the pose: the contact goes along the outline, the finger's way turns.
    tip = rotate(
        -middle,
        0.5 * (way.tips[:, k] + way.tips[:, k + 1]) - 0.5 * (way.poses[:, k, :2] + way.poses[:, k + 1, :2]),
    )
    shift = np.zeros((len(p), 2, 3))
    shift[:, 0, 0] = shift[:, 1, 1] = -1.0
    shift[:, :, 2] = -perpendicular(tip)
    shift = np.einsum("ni,nj,njk->nik", tangent, tangent, shift)
    turned = np.zeros((len(p), 2, 3))
    turned[:, :, 2] = -perpendicular(u)
    closing = V[:, 2, None, None] * np.stack([-shift[:, 1], shift[:, 0]], axis=1) - turned
    pose = np.zeros((len(p), 3, 3))
    pose[:, 0] = np.where(stick[:, None], closing[:, 0], np.einsum("nd,ndi->ni", normal, closing))
    pose[:, 1] = np.where(stick[:, None], closing[:, 1], 0.0)
    pose[:, 2] = shift[:, 1] * force[:, :1] - shift[:, 0] * force[:, 1:]
    solved = -np.linalg.solve(G + 1e-12 * np.eye(3), np.concatenate([pose, right], axis=2))
    return V, solved[:, :, :3], solved[:, :, 3:]
