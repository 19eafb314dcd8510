"""Judges an entry on a scene: makes its strokes in a simulator that it did not choose, and measures them."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import module_from_spec, spec_from_file_location
from itertools import pairwise
from pathlib import Path
from typing import Protocol

import numpy as np
import shapely
from numpy.typing import NDArray

import flatpush as fp
from flatpush.geometry import transform, wrap_angle
from flatpush.simulation.plant import Plant

Array = NDArray[np.float64]
Policy = Callable[[Array], Array | None]
Entry = Callable[[fp.Scene], Policy]
REFERENCE = Path(__file__).parents[2] / "tests" / "oracles" / "mujoco_reference.py"

SWITCH = 0.03  # a stroke that begins elsewhere than the last one ended costs as much as so much way [m]
LONGEST = 6.0  # way of the fingers in all [m]
MOST = 2000  # strokes
TOUCH = 1e-4  # a finger lands in the object, or something in an obstacle, if by more [m]
STEP = 2e-3  # the hand's poses are judged at most so far apart [m]
JUDGED_SPEED, JUDGED_STEP = 0.03, 1e-4  # of the fingers in MuJoCo [m/s], [s]


class Physics(Protocol):
    """A simulator of one scene."""

    def stroke(self, pose: Array, hands: Array) -> Array | None:
        """Poses X_WO (n, 3) of an object that rests, under poses X_WE (n, 3) of the hand; None if it is jammed."""
        ...


@dataclass(frozen=True)
class Verdict:
    """What became of an entry on a scene.

    Attributes:
        reason: "" for a success, or what went wrong.
        cost: way of the fastest fingertip in all strokes, and 30 mm for each change of contact [m].
        strokes: changes of contact and one. seconds: CPU time of the entry's calls [s].
        distance, angle: of the object from its goal at the end [m, rad].
    """

    reason: str
    cost: float
    strokes: int
    seconds: float
    distance: float
    angle: float


class PlantPhysics:
    """flatpush's own simulator with the exact limit surface of the feet."""

    def __init__(self, scene: fp.Scene) -> None:
        self._plant = Plant(scene.object, fingertips(scene), scene.pusher.tip_radius)

    def stroke(self, pose: Array, hands: Array) -> Array | None:
        run = self._plant.follow(pose, hands)  # out of what a landing may overlap by
        return None if run.outcome else run.object


class MujocoPhysics:
    """Feet, fingers and Coulomb friction in MuJoCo, which knows nothing of limit surfaces."""

    def __init__(self, scene: fp.Scene) -> None:
        spec = spec_from_file_location("mujoco_reference", REFERENCE)
        assert spec is not None
        assert spec.loader is not None
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
        self._reference = module.Reference(
            scene.object,
            fingertips(scene),
            scene.pusher.tip_radius,
            boxes(scene.object),
            JUDGED_SPEED,
            JUDGED_STEP,
        )

    def stroke(self, pose: Array, hands: Array) -> Array | None:
        found = self._reference.follow(pose, hands)
        return found if np.all(np.isfinite(found)) else None


PHYSICS: dict[str, Callable[[fp.Scene], Physics]] = {"plant": PlantPhysics, "mujoco": MujocoPhysics}


def judged(scene: fp.Scene, entry: Entry, physics: Callable[[fp.Scene], Physics]) -> Verdict:
    """Calls an entry with a scene, and what it gives with the object's pose before each stroke, until it has enough."""
    world, pose, last = physics(scene), scene.start_pose, None
    cost, strokes, way = 0.0, 0, 0.0
    seconds, began, reason = 0.0, time.process_time(), ""
    policy = entry(scene)
    for _ in range(MOST):
        answer = policy(pose.copy())
        seconds += time.process_time() - began
        if answer is None:
            break
        try:
            hands = finer(scene, answer)
        except ValueError as error:
            reason = str(error)
            break
        way += length(scene, hands)
        if last is None or not np.allclose(hands[0], last, rtol=0.0, atol=1e-6):
            reason = landed(scene, pose, hands[0])
            strokes += 1
        if way > LONGEST:
            reason = "too long a way"
        if reason:
            break
        poses = world.stroke(pose, hands)
        reason = "jammed" if poses is None else collision(scene, poses, hands)
        if poses is None or reason:
            break
        pose, last, began = poses[-1], hands[-1], time.process_time()
    else:
        reason = "too many strokes"
    off = pose - scene.goal_pose
    off[2] = wrap_angle(off[2])
    if not reason and np.any(np.abs(off) > np.asarray(scene.planning.goal_tolerance)):
        reason = "missed" if strokes else "no answer"
    cost = way + SWITCH * max(0, strokes - 1)
    return Verdict(reason, cost, strokes, seconds, float(np.hypot(*off[:2])), float(abs(off[2])))


def fingertips(scene: fp.Scene) -> Array:
    """Centres in the frame of the hand, shape (1 or 2, 2) [m]."""
    half = 0.5 * scene.pusher.spacing
    return np.zeros((1, 2)) if scene.pusher.fingers == 1 else np.array([[0.0, half], [0.0, -half]])


def length(scene: fp.Scene, hands: Array) -> float:
    """Way of the fastest fingertip along poses of the hand (n, 3), straight between [m]."""
    moves = np.abs(np.diff(hands, axis=0))
    reach = float(np.max(np.hypot(*fingertips(scene).T)))
    return float(np.sum(np.hypot(moves[:, 0], moves[:, 1]) + reach * moves[:, 2]))


def finer(scene: fp.Scene, answer: object) -> Array:
    """A stroke as it is made: poses of the hand (n, 3), straight between, no two far apart.

    Raises:
        ValueError: if it is no such thing.
    """
    hands = np.asarray(answer, dtype=float)
    if hands.ndim != 2 or hands.shape[1] != 3 or len(hands) < 2 or not np.all(np.isfinite(hands)):
        raise ValueError("a stroke is finite numbers, shape (n, 3), two poses or more")
    made = [hands[:1]]
    for a, b in pairwise(hands):
        parts = 1 + int(length(scene, np.stack([a, b])) / STEP)
        made.append(a + np.arange(1, parts + 1)[:, None] / parts * (b - a))
    return np.concatenate(made)


def landed(scene: fp.Scene, pose: Array, hand: Array) -> str:
    """What is wrong with a place where fingers come down; "" if nothing is."""
    body = shapely.Polygon(transform(pose, scene.object.outline.polyline()))
    near = body.distance(shapely.MultiPoint(transform(hand, fingertips(scene))))
    return "landed in the object" if near < scene.pusher.tip_radius - TOUCH else ""


def collision(scene: fp.Scene, poses: Array, hands: Array) -> str:
    """What object or fingers hit on their way; "" if nothing."""
    bounds, obstacles = scene.workspace.bounds, scene.workspace.obstacles
    if bounds is None and not obstacles:
        return ""
    table = shapely.box(*bounds) if bounds is not None else None
    blocks = shapely.MultiPolygon([shapely.Polygon(o.polyline()) for o in obstacles])
    outline, tip = scene.object.outline.polyline(), scene.pusher.tip_radius - TOUCH
    for pose, hand in zip(poses, hands, strict=True):
        body = shapely.Polygon(transform(pose, outline)).buffer(-TOUCH)
        tips = shapely.MultiPoint(transform(hand, fingertips(scene))).buffer(tip)
        for what, shape in (("object", body), ("finger", tips)):
            if blocks.intersects(shape) or not (table is None or table.covers(shape)):
                return f"{what} hit something"
    return ""


def boxes(thing: fp.Object) -> list[tuple[float, float, float, float]]:
    """(xmin, ymin, xmax, ymax) of the boxes between the corners of a hollow outline; none for others."""
    shape = shapely.Polygon(thing.outline.polyline())
    if thing.outline.is_circle or shape.convex_hull.area - shape.area < 1e-9:
        return []
    found = []
    for a, b in pairwise(np.unique(thing.outline.vertices[:, 0]).tolist()):
        middle = shapely.LineString([(0.5 * (a + b), -1.0), (0.5 * (a + b), 1.0)])
        _, low, _, high = shape.intersection(middle).bounds
        found.append((a, low, b, high))
    return found


def table(verdicts: Sequence[Verdict], scenes: Sequence[fp.Scene]) -> Iterator[str]:
    """Rows of a table in Markdown: for each kind of scene successes, cost and time."""
    yield "| fingers | friction | obstacles | solved | cost of solved (median) | CPU s (median, most) | others |"
    yield "|---|---|---|---|---|---|---|"
    kinds: dict[tuple[str, str, str], list[Verdict]] = {}
    for verdict, scene in zip(verdicts, scenes, strict=True):
        kind = (
            str(scene.pusher.fingers),
            "yes" if scene.object.friction else "no",
            "yes" if scene.workspace.obstacles else "no",
        )
        kinds.setdefault(kind, []).append(verdict)
    for kind in sorted(kinds):
        yield _row(kind, kinds[kind])
    yield _row(("all", "", ""), verdicts)


def _row(kind: tuple[str, str, str], verdicts: Sequence[Verdict]) -> str:
    good = [v for v in verdicts if not v.reason]
    why: dict[str, int] = {}
    for v in verdicts:
        if v.reason:
            why[v.reason] = why.get(v.reason, 0) + 1
    cost = f"{1000 * np.median([v.cost for v in good]):.0f} mm" if good else "–"
    seconds = [v.seconds for v in verdicts]
    others = ", ".join(f"{reason}: {n}" for reason, n in sorted(why.items()))
    return (
        f"| {' | '.join(kind)} | {len(good)} of {len(verdicts)} | {cost} |"
        f" {np.median(seconds):.2f}, {max(seconds):.2f} | {others} |"
    )
