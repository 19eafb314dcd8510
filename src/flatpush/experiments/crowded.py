"""Scenes full of obstacles: a narrow passage, a trap, a cluttered table, two hundred obstacles, and carved ones.

A carved scene can be solved for certain: random pushes are driven first, and obstacles stand only where object, fingers
and the hand that changes its push leave room. Everything is drawn from a seed.

As an experiment it plans each of them and prints how soon the first path came, what is best and how clear it is.
"""

import pathlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from ..geometry import Outline, compose, exp, transform
from ..geometry.pose import Array
from ..planning import Planner
from ..planning.assembly import car_of
from ..planning.options import PushOption
from ..planning.path import Path, Piece
from ..problem import Object, Planning, Pusher, Scene, Workspace

OBJECTS: tuple[tuple[tuple[float, float], ...], ...] = (
    ((0.0197, -0.0095), (0.0197, 0.019), (-0.0393, -0.0095)),
    ((0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)),
    ((-0.02, -0.02), (0.03, -0.02), (0.03, 0.0), (0.0, 0.0), (0.0, 0.03), (-0.02, 0.03)),
)
FRICTIONS = 0.3, 0.45, 0.6
ROOM = 0.003  # that a carved path has [m]
STEP = 0.001  # between the poses that are carved out [m]
SECONDS = 2.0  # of planning each scene


@dataclass(frozen=True, eq=False)
class Carved:
    """A scene with a path that its obstacles leave room for, of pushes that are numbers of the options."""

    scene: Scene
    options: tuple[PushOption, ...]
    path: Path


def carved(
    seed: int, *, pushes: int = 3, obstacles: tuple[int, int] = (5, 40), round_: float = 0.2
) -> Carved:
    """A random scene that can be solved.

    Args:
        seed: of everything; the object is one of three, in turn.
        pushes: the path has one to so many.
        obstacles: at least and at most so many are tried to be placed.
        round_: the part of them that are circles.
    """
    import shapely

    rng = np.random.default_rng(seed)
    thing, pusher, planner = _thing(seed % len(OBJECTS), int(rng.integers(len(FRICTIONS))))
    start = np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
    X, solid, pieces = start, [], list[Piece]()
    for _ in range(int(rng.integers(1, pushes + 1))):
        push = int(rng.integers(len(planner.usable)))
        option = planner.usable[push]
        car = car_of(option)
        shape, middle, hand = _driven(thing, pusher, option)
        begin = X
        for letter in rng.permutation(3):
            amount = rng.uniform(0.02, 0.12) if letter == 1 else rng.uniform(0.1, 1.2)
            unit = 1.0 if letter == 1 else car.radius
            twist = (car.left, car.straight, car.right)[letter] * unit
            shares = np.linspace(0, 1, 1 + int(np.ceil(amount * unit / STEP)))
            poses = compose(X, exp(shares[:, None] * amount * twist))
            solid += [_moved(shape, pose) for pose in poses]
            X = poses[-1]
            pieces.append((push, int(letter), float(amount)))
        # Room for the hand, however it is turned, at both ends of a push.
        solid += [shapely.Point(transform(pose, middle)).buffer(1.2 * hand) for pose in (begin, X)]
    way = shapely.union_all(solid).buffer(ROOM)
    xmin, ymin, xmax, ymax = way.bounds
    room = rng.uniform(0.01, 0.06)
    box = (xmin - room, ymin - room, xmax + room, ymax + room)
    placed = _strewn(rng, way, (xmin - 0.05, ymin - 0.05, xmax + 0.05, ymax + 0.05), obstacles, round_)
    planning = Planning(seed=seed, time_limit=5.0, iterations=10**6)
    scene = Scene(thing, start, X, pusher, workspace=Workspace(box, placed), planning=planning)
    return Carved(scene, planner.usable, Path.of(planner.fleet, start, pieces))


def narrow_passage(gap: float = 0.045) -> Scene:
    """Two rooms and a wall with a gap [m]; the object, 50 × 35 mm, fits through with its short side ahead."""
    wall, half = 0.02, 0.5 * gap
    low = [(-wall, -0.2), (wall, -0.2), (wall, -half), (-wall, -half)]
    high = [(x, -y) for x, y in low]
    return _scene((-0.15, 0.02, 0.4), (0.15, -0.05, 2.0), (-0.28, -0.2, 0.28, 0.2), (low, high))


def trap() -> Scene:
    """A bay that opens towards the start, with the goal right behind its end: what goes straight on is caught."""
    t = 0.012
    bay = [(-0.1, 0.08), (0.06, 0.08), (0.06, -0.08), (-0.1, -0.08), (-0.1, -0.08 + t), (0.06 - t, -0.08 + t),
           (0.06 - t, 0.08 - t), (-0.1, 0.08 - t)]  # fmt: skip
    return _scene((-0.05, 0.0, 0.0), (0.13, 0.0, 0.0), (-0.26, -0.22, 0.24, 0.22), (bay,))


def cluttered_table(seed: int = 0) -> Scene:
    """A table of 0.8 × 0.5 m with cups (circles) and boxes; about a quarter of it is taken."""
    import shapely

    rng = np.random.default_rng(seed)
    start, goal = (-0.32, -0.15, 0.6), (0.32, 0.15, -2.0)
    free = shapely.union_all([shapely.Point(p[:2]).buffer(0.06) for p in (start, goal)])
    placed: list[Outline] = []
    solid = free
    for _ in range(400):
        at = rng.uniform((-0.38, -0.23), (0.38, 0.23))
        if rng.random() < 0.4:
            outline = Outline.circle(rng.uniform(0.02, 0.04), at)
        else:
            corners = rng.uniform(0.015, 0.05, 2) * [(-1, -1), (1, -1), (1, 1), (-1, 1)]
            outline = Outline.polygon(transform([*at, rng.uniform(0, np.pi)], corners))
        shape = shapely.Polygon(outline.polyline())
        if shape.distance(solid) > 0.07 or not shape.intersects(solid):
            # Either far from everything or at least a hand's breadth from the others.
            if shape.distance(solid) < 0.055:
                continue
            placed.append(outline)
            solid = solid.union(shape)
    return _scene(start, goal, (-0.4, -0.25, 0.4, 0.25), tuple(placed), seed)


def many_obstacles(seed: int = 0) -> Scene:
    """A carved scene with two hundred obstacles, closer than anything could pass but along the carved path."""
    return carved(seed, obstacles=(200, 200)).scene


SCENES: dict[str, Callable[[], Scene]] = {
    "narrow passage": narrow_passage,
    "trap": trap,
    "cluttered table": cluttered_table,
    "200 obstacles": many_obstacles,
    "carved": lambda: carved(1).scene,
}


def run(figures: pathlib.Path | None) -> str:
    """A table of all scenes; into the folder, a drawing of each plan."""
    rows = ["scene            obstacles  first path   best   clearance"]
    for name, make in SCENES.items():
        planner = Planner(make())
        plan = planner.plan()
        count = len(plan.scene.workspace.obstacles)
        if plan.certificate is None:
            rows.append(f"{name:<16} {count:9d}  {plan.reason}")
            continue
        first = 1e3 * float(str(plan.run["first_path_time"] or 0.0))
        rows.append(
            f"{name:<16} {count:9d}  {first:7.1f} ms  {plan.cost:.3f} m"
            f"  {1e3 * (plan.certificate.clearance or 0.0):.2f} mm"
        )
        if figures is not None:
            from ..view import save_figure

            save_figure(plan, figures / f"{name.replace(' ', '_')}.svg")
    return "\n".join(rows)


def _scene(start: Any, goal: Any, bounds: Any, obstacles: Any, seed: int = 0) -> Scene:
    thing, pusher, _ = _thing(1, 1)
    planning = Planning(seed=seed, time_limit=SECONDS, iterations=10**6)
    return Scene(thing, start, goal, pusher, workspace=Workspace(bounds, obstacles), planning=planning)


@cache
def _thing(number: int, friction: int) -> tuple[Object, Pusher, Planner]:
    """An object, its pusher and a planner with the pushes: the same ones for every scene, so they are sought once."""
    thing = Object(OBJECTS[number], "uniform", friction=FRICTIONS[friction])
    pusher = Pusher(fingers=2, spacing=0.015)
    return thing, pusher, Planner(Scene(thing, (0.1, 0.0, 0.0), pusher=pusher))


def _driven(thing: Object, pusher: Pusher, option: PushOption) -> tuple[Any, Array, float]:
    """What moves along with a push, landing and leaving included; middle and reach of the hand; all in O."""
    import shapely

    placement = option.placement
    assert placement is not None  # it is a car
    back = transform([0.0, 0.0, placement.pose[2]], [-pusher.approach, 0.0])
    fingers = [shapely.LineString([tip, tip + back]).buffer(pusher.tip_radius) for tip in placement.tips]
    shape = shapely.union_all([shapely.Polygon(thing.outline.polyline()), *fingers])
    middle = placement.pose[:2]
    return shape, middle, float(np.max(np.linalg.norm(placement.tips - middle, axis=1))) + pusher.tip_radius


def _strewn(rng: Any, way: Any, box: Any, obstacles: tuple[int, int], round_: float) -> tuple[Outline, ...]:
    """Random obstacles in a box that do not meet the way."""
    import shapely

    placed: list[Outline] = []
    shapely.prepare(way)
    count = int(rng.integers(obstacles[0], obstacles[1] + 1))
    for _ in range(40 * count):
        middle, n = rng.uniform(box[:2], box[2:]), int(rng.integers(3, 8))
        size = rng.uniform(0.008, 0.06) * min(1.0, np.sqrt(20 / count))
        angles, parts = np.sort(rng.uniform(0, 2 * np.pi, n)), size * rng.uniform(0.5, 1.0, n)
        if rng.random() < round_:
            if shapely.Point(middle).distance(way) > 0.5 * size:
                placed.append(Outline.circle(0.5 * size, middle))
        else:
            corners = middle + parts[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
            polygon = shapely.Polygon(corners)
            if polygon.is_valid and polygon.area > 0.05 * size**2 and not way.intersects(polygon):
                placed.append(Outline.polygon(corners))
        if len(placed) == count:
            break
    return tuple(placed)


def _moved(shape: Any, pose: Array) -> Any:
    from shapely.affinity import affine_transform

    c, s = np.cos(pose[2]), np.sin(pose[2])
    return affine_transform(shape, [c, -s, s, c, pose[0], pose[1]])
