"""Random scenes that can be solved: obstacles stand where a known path of random pushes leaves room.

python benchmarks/carved.py [COUNT [SECONDS]] plans them and prints how many are solved, how fast and how clear.
"""

import sys
import time

import numpy as np
import shapely

import flatpush as fp
from flatpush.geometry import Outline, compose, exp, transform
from flatpush.planning.assembly import car_of

BODY = 0.05  # about the size of the objects [m]
MARGIN = 0.003  # room that the carved path has [m]
OBJECTS = (
    [(0.0197, -0.0095), (0.0197, 0.019), (-0.0393, -0.0095)],
    [(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)],
    [(-0.02, -0.02), (0.03, -0.02), (0.03, 0.0), (0.0, 0.0), (0.0, 0.03), (-0.02, 0.03)],
)


def carved_task(seed: int):
    """A carved scene's task with the one push of its path."""
    from flatpush.planning.obstacles import task_of

    scene, used = carved(seed, most=1, with_pushes=True)
    planner = fp.Planner(replace(scene, pushes=(used[0].push,)), tree=False)
    return task_of(planner.scene, planner.usable, planner.fleet)


def carved(seed: int, time_limit: float = 5.0, most: int = 3, with_pushes: bool = False):
    """A scene with 5 to 40 obstacles about the path of one to three random pushes."""
    rng = np.random.default_rng(seed)
    thing = fp.Object(OBJECTS[seed % 3], "uniform", friction=float(rng.uniform(0.25, 0.6)))
    pusher = fp.Pusher(fingers=2, spacing=0.015)
    options = fp.Planner(fp.Scene(thing, (0.0, 0.0, 0.0), (0.1, 0.0, 0.0), pusher=pusher), tree=False).usable
    start = np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
    X, solid = start, []
    for _ in range(int(rng.integers(1, 4))):
        option = options[int(rng.integers(len(options)))]
        car, placement = car_of(option), option.placement
        back = transform([0.0, 0.0, placement.pose[2]], [-pusher.approach, 0.0])
        fingers = [shapely.LineString([tip, tip + back]).buffer(pusher.tip_radius) for tip in placement.tips]
        shape = shapely.union_all([shapely.Polygon(thing.outline.polyline()), *fingers])
        hand = float(np.max(np.linalg.norm(placement.tips - placement.pose[:2], axis=1))) + pusher.tip_radius
        for letter in rng.permutation(3):
            twist = (car.left, car.straight, car.right)[letter]
            length = rng.uniform(0.02, 0.12) if letter == 1 else rng.uniform(0.1, 1.2) * car.radius
            steps = np.linspace(0, 1, 1 + int(np.ceil(length / 0.001)))
            poses = compose(X, exp(steps[:, None] * length * twist))
            solid += [_moved(shape, pose) for pose in poses]
            X = poses[-1]
        # Room for the hand at both ends of a push.
        solid += [shapely.Point(transform(X, placement.pose[:2])).buffer(1.2 * hand)]
    way = shapely.union_all(solid).buffer(MARGIN)
    xmin, ymin, xmax, ymax = way.bounds
    room = rng.uniform(0.01, 0.06)
    obstacles: list[Outline] = []
    count = int(rng.integers(5, 41))
    for _ in range(40 * count):
        middle = rng.uniform([xmin - 0.05, ymin - 0.05], [xmax + 0.05, ymax + 0.05])
        n, size = int(rng.integers(3, 8)), rng.uniform(0.008, 0.06)
        angles = np.sort(rng.uniform(0, 2 * np.pi, n))
        corners = middle + size * rng.uniform(0.5, 1.0, n)[:, None] * np.column_stack(
            [np.cos(angles), np.sin(angles)]
        )
        polygon = shapely.Polygon(corners)
        if polygon.is_valid and polygon.area > 1e-5 and not polygon.intersects(way):
            obstacles.append(corners)
        if len(obstacles) == count:
            break
    bounds = (xmin - room, ymin - room, xmax + room, ymax + room)
    return fp.Scene(
        thing,
        start,
        X,
        pusher=pusher,
        workspace=fp.Workspace(bounds, tuple(obstacles)),
        planning=fp.Planning(seed=seed, time_limit=time_limit, iterations=10**6),
    )


def _moved(shape, pose):
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return shapely.affinity.affine_transform(shape, [c, -s, s, c, pose[0], pose[1]])


def gap(plan: fp.Plan) -> float:
    """The least distance of object and fingertips from anything while pushing, at steps of 0.1 mm, by shapely [m]."""
    scene, best = plan.scene, np.inf
    box = shapely.box(*scene.workspace.bounds)
    solids = [shapely.Polygon(o) for o in scene.workspace.obstacles]
    tree = shapely.STRtree(solids)
    for segment in plan.pushes:
        X = segment.object[0]
        tips = transform(fp.geometry.relative(X, segment.pusher[0]), segment.fingers)
        for arc in segment.arcs:
            step = arc.duration * np.asarray(arc.twist)
            n = int(np.ceil((np.hypot(*step[:2]) + abs(step[2]) * 0.06) / 1e-4)) + 1
            poses = compose(X, exp(np.linspace(0, 1, n)[:, None] * step))
            X = poses[-1]
            corners = np.stack([transform(poses, v) for v in scene.object.outline.vertices], axis=1)
            shapes = [(shapely.polygons(corners), 0.0)]
            shapes += [(shapely.points(transform(poses, t)), scene.pusher.tip_radius) for t in tips]
            for geometry, radius in shapes:
                _, distance = tree.query_nearest(geometry, return_distance=True, all_matches=False)
                best = min(best, float(np.min(distance)) - radius)
                if not np.all(shapely.covers(box, geometry)):
                    best = min(best, -1.0)
                best = min(best, float(np.min(shapely.distance(box.exterior, geometry))) - radius)
    return best


def main(count: int, seconds: float) -> None:
    fp.Planner(carved(0), tree=False).plan()
    first, solved, gaps, unsolved = [], 0, [], []
    for seed in range(count):
        scene = carved(seed)
        planner = fp.Planner(scene, tree=False)
        began = time.perf_counter()
        answers = planner.answers()
        answer = next(answers)
        if np.isfinite(answer.cost):
            solved += 1
            first.append(time.perf_counter() - began)
            while time.perf_counter() - began < seconds:
                try:
                    answer = next(answers)
                except StopIteration:
                    break
            plan = answer.plan()
            gaps.append(gap(plan))
            assert plan.certificate.clearance >= 0, seed
        else:
            unsolved.append(seed)
            print("unsolved", seed, time.perf_counter() - began, answer.plan().reason)
    times = 1e3 * np.quantile(first, [0.5, 0.95, 1.0])
    print(
        f"{solved} of {count} solved; first path {times.round(1)} ms (median, 95 %, most); unsolved {unsolved}"
    )
    print(f"least clearance by dense samples {1e3 * min(gaps):.4f} mm; {sum(g < 0 for g in gaps)} below zero")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100, float(sys.argv[2]) if len(sys.argv) > 2 else 0.5)
