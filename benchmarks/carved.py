"""Random scenes that can be solved (flatpush.experiments.crowded): how many are, how soon, and how clear the plans are.

python benchmarks/carved.py [COUNT [SECONDS [LIMIT]]] plans each for some seconds, or to the limit without
a plan.
The clearance is that of dense samples by shapely: no corner or fingertip moves further than 0.1 mm between two of them.
"""

import sys
import time
from dataclasses import replace

import numpy as np
import shapely

import flatpush as fp
from flatpush.experiments.crowded import carved
from flatpush.geometry import compose, exp, relative, transform
from flatpush.planning.obstacles import query_of
from flatpush.planning.query import Query


def carved_query(seed: int) -> Query:
    """The query of a carved scene with the one push of its path."""
    found = carved(seed, pushes=1)
    planner = fp.Planner(replace(found.scene, pushes=(found.options[found.path.pushes[0]].push,)))
    return query_of(planner.scene, planner.usable, planner.fleet)


def gap(plan: fp.Plan) -> float:
    """The least distance of object and fingertips from anything while pushing, by dense samples [m]."""
    scene, best = plan.scene, np.inf
    box = shapely.box(*scene.workspace.bounds)
    solids = [(shapely.Point(o.centre) if o.is_circle else shapely.Polygon(o.vertices), o.radius)
              for o in scene.workspace.obstacles]  # fmt: skip
    reach = scene.object.outline.radius_about((0.0, 0.0)) + 0.01
    for segment in plan.pushes:
        X = segment.object[0]
        tips = transform(relative(X, segment.pusher[0]), segment.fingers)
        for arc in segment.arcs:
            step = arc.duration * np.asarray(arc.twist)
            n = int(np.ceil((np.hypot(*step[:2]) + abs(step[2]) * reach) / 1e-4)) + 1
            poses = compose(X, exp(np.linspace(0, 1, n)[:, None] * step))
            X = poses[-1]
            corners = np.stack([transform(poses, v) for v in scene.object.outline.vertices], axis=1)
            shapes = [(shapely.polygons(corners), 0.0)]
            shapes += [(shapely.points(transform(poses, t)), scene.pusher.tip_radius) for t in tips]
            for geometry, radius in shapes:
                inside = shapely.covers(box, geometry)
                best = min(best, float(np.min(shapely.distance(box.exterior, geometry))) - radius)
                best = best if np.all(inside) else min(best, -1.0)
                near = shapely.union_all(shapely.envelope(geometry[:: max(1, n // 50)])).buffer(0.02)
                for solid, r in solids:
                    if solid.distance(near) <= r:
                        shapely.prepare(solid)
                        best = min(best, float(np.min(shapely.distance(geometry, solid))) - radius - r)
    return best


def main(count: int, seconds: float, limit: float) -> None:
    fp.Planner(carved(0).scene).plan()
    built, first, gaps, unsolved, late = [], [], [], [], []
    for seed in range(count):
        scene = replace(
            carved(seed).scene, planning=fp.Planning(seed=seed, time_limit=limit, iterations=10**6)
        )
        began = time.thread_time()
        planner = fp.Planner(scene)
        built.append(time.thread_time() - began)
        clock, best = time.perf_counter(), None
        for answer in planner.answers():
            if np.isfinite(answer.cost) and best is None:
                first.append(answer.found["first_path_time"])
            best = answer
            if np.isfinite(best.cost) and time.perf_counter() - clock > seconds:
                break
        spent = time.perf_counter() - clock
        plan = best.plan()
        if plan.status == "solved":
            gaps.append(gap(plan))
            assert plan.certificate.clearance >= 0, seed
            if first[-1] > limit:
                late.append(seed)
        else:
            unsolved.append((seed, round(spent, 2)))
            print("unsolved", seed, f"{spent:.2f} s:", plan.reason, flush=True)
    times = 1e3 * np.quantile(first, [0.5, 0.95, 1.0])
    print(f"{len(first)} of {count} solved, {len(late)} of them late; without a plan (seed, s): {unsolved}")
    print(
        f"first path {times.round(1)} ms (median, 95 %, most); a planner is built in {1e3 * np.median(built):.0f} ms"
    )
    print(
        f"least clearance by dense samples {1e3 * min(gaps):.4f} mm; {sum(g < 0 for g in gaps)} plans below zero"
    )


if __name__ == "__main__":
    given = [*sys.argv[1:], *("100", "0.2", "5")[len(sys.argv) - 1 :]]
    main(int(given[0]), float(given[1]), float(given[2]))
