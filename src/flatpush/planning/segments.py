"""From a word of a car to a timed push."""

from dataclasses import dataclass

import numpy as np

from ..contact.cone_twists import OFF_CENTRE
from ..geometry import compose, exp, transform
from ..geometry.pose import Array
from ..problem import Arc, Pusher, PushSegment, Scene
from ..steering.car import Car
from ..steering.time_law import Trapezoid

# Straight interpolation between samples stays within these [m, rad]: half of what the plan document promises.
SAG, SAG_ANGLE = 2e-5, 4e-4
NOTHING = 1e-10  # arcs of a smaller angle [rad] or length [m] are left out
TURNS = {"L": "left", "S": "straight", "R": "right"}


@dataclass(frozen=True, eq=False)
class ArcGeometry:
    """One arc before it is timed: turn, displacement as a body twist, and the fastest fingertip's length and radius."""

    turn: str
    step: Array
    tip_length: float
    tip_radius: float
    flat_length: float


def arcs_of(car: Car, word: str, parameters: Array, fingers: Array) -> list[ArcGeometry]:
    """The arcs of a word: angles [rad] of turns, lengths [m] of straight motions; arcs of no length are left out."""
    twists = {"L": car.left, "S": car.straight, "R": car.right}
    reaches = dict(zip("LSR", tip_radii(car, fingers), strict=True))
    found: list[ArcGeometry] = []
    for letter, value in _joined(word, parameters):
        flat = float(value) * (car.radius if letter != "S" else 1.0)
        reach = float(reaches[letter])
        length = float(value) * (1.0 if letter == "S" else reach)
        found.append(ArcGeometry(TURNS[letter], flat * twists[letter], length, reach, flat))
    return found


def _joined(word: str, parameters: Array) -> list[tuple[str, float]]:
    """Letters and amounts; equal turns that follow each other, with nothing between them, become one."""
    found: list[tuple[str, float]] = []
    for letter, value in zip(word, parameters, strict=True):
        if value <= NOTHING:
            continue
        if found and found[-1][0] == letter:
            found[-1] = (letter, found[-1][1] + float(value))
        else:
            found.append((letter, float(value)))
    return found


def tip_radii(car: Car, fingers: Array) -> Array:
    """Radii of the fastest fingertip's way in the left turn, straight (inf) and in the right turn, shape (3,) [m]."""
    tips = transform(car.pusher, fingers)
    left, right = (
        float(np.max(np.linalg.norm(tips - centre, axis=1))) for centre in (car.left_centre, car.right_centre)
    )
    return np.array([left, np.inf, right])


def arc_law(arc: ArcGeometry, pusher: Pusher) -> Trapezoid:
    """The time law of an arc, whose hand turns with the object."""
    return Trapezoid.along(
        arc.tip_length, arc.tip_radius, pusher.speed, pusher.acceleration, pusher.turn_rate
    )


def push_segment(
    scene: Scene, name: str, car: Car, fingers: Array, arcs: list[ArcGeometry], start: Array
) -> PushSegment:
    """The timed push that follows the arcs from a pose X_WO."""
    pusher, cost = scene.pusher, scene.planning.cost
    far = scene.object.outline.radius_about((0.0, 0.0))
    times, poses, made = [np.zeros(1)], [np.asarray(start, dtype=float)[None]], []
    clock, X = 0.0, np.asarray(start, dtype=float)
    for arc in arcs:
        law = arc_law(arc, pusher)
        turn = abs(float(arc.step[2]))
        # The farthest point of the object from the turning centre bows and accelerates the most.
        reach = far + float(np.hypot(*arc.step[:2])) / turn if turn > 0 else far
        ratio = max(1.0, reach / arc.tip_radius)
        bend = float(np.sqrt(8 * SAG / reach))
        if turn > 0 and len(fingers) == 2:
            bend = min(bend, 2 * OFF_CENTRE / arc.tip_radius)
        t, fraction = law.samples(
            min(np.sqrt(8 * SAG / (pusher.acceleration * ratio)),
                np.sqrt(8 * SAG_ANGLE * arc.tip_radius / pusher.acceleration)),
            int(np.ceil(turn / bend)) + 1,
        )  # fmt: skip
        times.append(clock + t[1:])
        poses.append(compose(X, exp(fraction[1:, None] * arc.step)))
        X = compose(X, exp(arc.step))
        clock += law.duration
        reach_E = (
            float(np.hypot(*(car.pusher[:2] - _centre(arc.step)))) * turn if turn > 0 else arc.flat_length
        )
        value = {"flat": arc.flat_length, "pusher": reach_E, "time": law.duration}[cost]
        made.append(Arc(arc.turn, arc.step / law.duration, law.duration, value))  # type: ignore[arg-type]
    all_poses = np.concatenate(poses)
    word = "".join(arc.turn[0].upper() for arc in arcs)
    return PushSegment(
        name, word, tuple(made), np.concatenate(times), all_poses, compose(all_poses, car.pusher), fingers
    )


def fingertips(push_fingers: int, spacing: float) -> Array:
    """Fingertip centres in E, shape (1 or 2, 2)."""
    return np.zeros((1, 2)) if push_fingers == 1 else np.array([[0.0, spacing / 2], [0.0, -spacing / 2]])


def _centre(step: Array) -> Array:
    return np.array([-step[1], step[0]]) / step[2]
