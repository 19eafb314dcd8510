"""One finger that keeps its direction: it rolls on the edge as the object turns, and the plan allows for it.

A rolling fingertip moves the contact by tip_radius · Δθ along a straight edge (on a circle of radius R by
Δθ / (1/R + 1/tip_radius)), so the turning centres move with the object's heading. The word's arcs are
integrated with the centres of the contact as it then is, and its three parameters solved for by Newton's method
from the word of the resting contact.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from ..errors import FlatpushError
from ..geometry import Outline, OutlinePoint, log, perpendicular, relative, rotate, velocity_at
from ..geometry.pose import Array
from ..problem import Arc, PushSegment, Scene
from ..problem.mechanics import contact_at
from ..steering.car import Car
from ..steering.time_law import Trapezoid
from .options import PushOption
from .segments import SAG, SAG_ANGLE, ArcGeometry, fingertips

NODES, GAUSS, FINE = 17, 24, 400
# The speed along the way is right to a few parts in 10⁵, so this much of the limits is used.
SLOWER = 0.999
# From sample to sample the finger makes the mean of the motions between, which takes up to 1e-5 more of the friction.
BETWEEN = 1e-4
SLACK = 0.3  # headings beyond the first word's over which the centres are tabulated [rad]


def rolled(outline: Outline, at: OutlinePoint, tip_radius: float, turn: float) -> OutlinePoint:
    """Where a tip that does not turn touches after the object has turned by an angle [rad].

    Turning to the left moves the contact to the left, as seen along the inward normal.

    Raises:
        FlatpushError: if it rolls off the edge.
    """
    if outline.is_circle:
        shift = turn / (1 / outline.radius + 1 / tip_radius) if tip_radius > 0 else 0.0
        return outline.at(0, at.along - shift / (2 * np.pi * outline.radius))
    start, end = outline.edges[at.edge]
    along = at.along - outline.sense * tip_radius * turn / float(np.hypot(*(end - start)))
    if not 0 < along < 1:
        raise FlatpushError(
            f"the finger keeps its direction and would roll off the edge while the object turns by"
            f" {np.rad2deg(turn):.0f}°"
        )
    return outline.at(at.edge, along)


@dataclass(frozen=True, eq=False)
class _Table:
    """Turning centres and straight direction against the object's turn, as Chebyshev series."""

    low: float
    high: float
    series: dict[str, Array]

    def at(self, turn: str, angle: Array) -> Array:
        x = (2 * np.asarray(angle) - self.low - self.high) / (self.high - self.low)
        return np.moveaxis(np.asarray(chebyshev.chebval(x, self.series[turn]), dtype=float), 0, -1)


def rolling_segment(
    scene: Scene, option: PushOption, arcs: list[ArcGeometry], start: Array, end: Array
) -> PushSegment:
    """The timed push of one finger that keeps its direction, from pose to pose (X_WO).

    Raises:
        FlatpushError: if the contact rolls off its edge, or no word of this kind reaches the goal.
    """
    turns = [arc.turn for arc in arcs]
    first = np.array([abs(a.step[2]) if a.turn != "straight" else a.flat_length for a in arcs])
    table = _tabulate(scene, option, turns, first)
    goal = np.array([*end[:2], start[2] + sum(float(a.step[2]) for a in arcs)])
    values = _solve(start, goal, turns, first, table)
    return _timed(scene, option, start, turns, values, table)


def _tabulate(scene: Scene, option: PushOption, turns: list[str], values: Array) -> _Table:
    heading = np.concatenate([[0.0], np.cumsum(_signed(turns, values))])
    low, high = float(heading.min()) - SLACK, float(heading.max()) + SLACK
    nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    rows: dict[str, list[Array]] = {"left": [], "straight": [], "right": []}
    assert option.car is not None
    margin = scene.planning.friction_margin
    margin += BETWEEN * (1 - margin)
    for angle in 0.5 * (low + high) + 0.5 * (high - low) * nodes:
        at = rolled(scene.object.outline, option.push.at, scene.pusher.tip_radius, float(angle))
        car = Car.of(
            contact_at(scene, at),
            option.car.surface,
            cof=scene.object.cof,
            margin=margin,
        )
        rows["left"].append(car.left_centre)
        rows["right"].append(car.right_centre)
        rows["straight"].append(car.direction)
    series = {
        key: chebyshev.chebfit(nodes, np.array(value), NODES - 1).astype(float) for key, value in rows.items()
    }
    return _Table(low, high, series)


def _signed(turns: list[str], values: Array) -> Array:
    signs = {"left": 1.0, "straight": 0.0, "right": -1.0}
    return np.array([signs[t] * v for t, v in zip(turns, values, strict=True)])


def _move(pose: Array, turn: str, values: Array, heading: float, table: _Table) -> Array:
    """The poses (n, 3) after parts of one arc: ∫ R(θ) (velocity of O per turn) dθ, or straight on."""
    values = np.atleast_1d(values)
    if turn == "straight":
        way = values[:, None] * rotate(pose[2], table.at(turn, np.array(heading)))
        return np.column_stack([pose[:2] + way, np.full(len(values), pose[2])])
    delta = values if turn == "left" else -values
    x, w = np.polynomial.legendre.leggauss(GAUSS)
    s = 0.5 * delta[:, None] * (x + 1)
    speed = rotate(pose[2] + s, perpendicular(-table.at(turn, heading + s)))
    return np.column_stack(
        [pose[:2] + 0.5 * delta[:, None] * np.einsum("g,ngk->nk", w, speed), pose[2] + delta]
    )


def _end(start: Array, turns: list[str], values: Array, table: _Table) -> Array:
    pose = start
    for turn, value in zip(turns, values, strict=True):
        pose = _move(pose, turn, np.array([value]), float(pose[2] - start[2]), table)[0]
    return pose


def _solve(start: Array, goal: Array, turns: list[str], values: Array, table: _Table) -> Array:
    """Newton on the arcs' parameters (least squares where there are fewer than three arcs)."""
    scale = np.array([1.0, 1.0, 0.1])
    for _ in range(30):
        error = (_end(start, turns, values, table) - goal) * scale
        if np.max(np.abs(error)) < 1e-12:
            break
        step = 1e-6
        columns = [
            ((_end(start, turns, values + step * unit, table) - goal) * scale - error) / step
            for unit in np.eye(len(values))
        ]
        change, *_ = np.linalg.lstsq(np.array(columns).T, error, rcond=None)
        values = values - change * min(1.0, 0.5 / max(1e-12, float(np.max(np.abs(change)))))
    if np.max(np.abs(_end(start, turns, values, table) - goal)) > 1e-9 or np.any(values < 0):
        raise FlatpushError("no word of this kind reaches the goal with a rolling finger")
    heading = np.cumsum(_signed(turns, values))
    if np.min(heading) < table.low or np.max(heading) > table.high:
        raise FlatpushError("the rolling finger turns the object further than foreseen")
    return values


def _timed(
    scene: Scene, option: PushOption, start: Array, turns: list[str], values: Array, table: _Table
) -> PushSegment:
    assert option.car is not None
    outline, pusher = scene.object.outline, scene.pusher
    hand = float(start[2] + option.car.pusher[2])

    def tip(pose: Array) -> Array:
        at = rolled(outline, option.push.at, pusher.tip_radius, float(pose[2] - start[2]))
        return pose[:2] + rotate(pose[2], at.point - pusher.tip_radius * at.normal)

    times, poses, arcs = [np.zeros(1)], [start[None]], []
    clock, pose = 0.0, start
    for turn, value in zip(turns, values, strict=True):
        heading = float(pose[2] - start[2])
        grid = np.linspace(0.0, float(value), FINE + 1)
        way = np.array([tip(X) for X in _move(pose, turn, grid, heading, table)])
        lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
        length = float(lengths[-1])
        radius = np.inf if turn == "straight" else length / float(value)
        law = Trapezoid.along(length, radius, SLOWER * pusher.speed, SLOWER * pusher.acceleration)
        far = outline.radius_about((0.0, 0.0)) + (0.0 if turn == "straight" else radius)
        t, fraction = law.samples(
            min(np.sqrt(8 * SAG / pusher.acceleration), np.sqrt(8 * SAG_ANGLE * radius / pusher.acceleration))
            / 2,
            1 if turn == "straight" else 3 * int(np.ceil(value / np.sqrt(8 * SAG / far))) + 1,
        )
        at = np.interp(fraction * length, lengths, grid)
        times.append(clock + t[1:])
        moved = _move(pose, turn, at, heading, table)
        poses.append(moved[1:])
        end = moved[-1]
        twist = log(relative(pose, end)) / law.duration
        cost = {
            "flat": float(np.hypot(*velocity_at(twist, option.car.flat_point))) * law.duration,
            "pusher": float(np.sum(np.linalg.norm(np.diff([tip(p) for p in moved], axis=0), axis=1))),
            "time": law.duration,
        }[scene.planning.cost]
        arcs.append(Arc(turn, twist, law.duration, cost))  # type: ignore[arg-type]
        clock += law.duration
        pose = end
    object_poses = np.concatenate(poses)
    pusher_poses = np.array([[*tip(p), hand] for p in object_poses])
    word = "".join(t[0].upper() for t in turns)
    return PushSegment(
        option.push.name,
        word,
        tuple(arcs),
        np.concatenate(times),
        object_poses,
        pusher_poses,
        fingertips(1, 0.0),
    )
