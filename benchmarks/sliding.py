"""Plans of sliding pushes without friction: how many end at their goal in the plant, and what planning takes.

    python benchmarks/sliding.py [N] [--noise] [NAME ...]

N random queries (default 50) of each object or of the named ones, starts up to 200 mm from the goal at any heading.
Each plan is rolled out in the plant as a whole, every push from where the last one left the object. With --noise
fingers have a friction that the planner does not know, the pose is seen with noise, and after each push the rest of
the plan is adjusted, or a new one made where that is not possible, until the object is where it should be, as often as
`flatpush track` would at most; the pushes counted are those made.
"""

import sys
import time

import numpy as np

import flatpush as fp
from flatpush.control.tracking.slides import MOST_SLIDES
from flatpush.geometry import Outline, pose_error
from flatpush.geometry.pose import Array
from flatpush.planning.sliding import SlidePlanner
from flatpush.simulation.plant import Plant

TIP = 0.0025
FARTHEST = 0.2
NEAR, NEAR_ANGLE = 1e-3, np.deg2rad(1.0)
SEEN = np.array([2e-4, 2e-4, np.deg2rad(0.2)])  # standard deviation of the pose seen
FRICTION = 0.05  # of fingers that are believed to have none


def objects() -> dict[str, fp.Object]:
    mm = 1e-3
    tee = [(-40, 0), (40, 0), (40, 20), (10, 20), (10, 80), (-10, 80), (-10, 20), (-40, 20)]
    corners = {
        "rectangle": [(-30, -20), (30, -20), (30, 20), (-30, 20)],
        "triangle": [(19.667, -9.5), (19.667, 19.0), (-39.333, -9.5)],
        "T": tee,
    }
    made = {name: fp.Object(mm * np.array(c), friction=0.0) for name, c in corners.items()}
    off = fp.Support.points([[0.008, 0.0], [0.02, 0.015], [0.02, -0.015]], [1.0, 1.0, 1.0])
    made["disc"] = fp.Object(Outline.circle(0.03), off, friction=0.0)
    return made


def drawn(rng: np.random.Generator) -> Array:
    far, (bearing, turn) = rng.uniform(0.0, FARTHEST), rng.uniform(-np.pi, np.pi, 2)
    return np.array([far * np.cos(bearing), far * np.sin(bearing), turn])


def plant_of(thing: fp.Object, friction: float = 0.0) -> Plant:
    return Plant(thing, [[0.0, 0.0]], TIP, friction=friction)


def pushed(plant: Plant, pose: Array, tip: Array) -> Array:
    hand = np.column_stack([tip[[0, -1]], np.zeros(2)])
    return plant.follow(pose, hand).object[-1]


def within(pose: Array, times: float = 1.0) -> bool:
    off = np.abs(pose_error(pose, np.zeros(3)))
    return bool(np.hypot(*off[:2]) <= times * NEAR and off[2] <= times * NEAR_ANGLE)


def main(count: int, noisy: bool, names: list[str]) -> None:
    for name, thing in objects().items():
        if names and name not in names:
            continue
        plant, rng = plant_of(thing), np.random.default_rng(1)
        planner = SlidePlanner(plant)
        took, good, numbers, misses = [], 0, [], []
        for _ in range(count):
            pose = drawn(rng)
            table, rest = plant_of(thing, FRICTION) if noisy else plant, ()
            looks = 0
            for _ in range(MOST_SLIDES if noisy else 1):
                looks += 1
                seen = pose + noisy * SEEN * rng.normal(size=3)
                began = time.process_time()
                plan = planner.continued(rest, seen, np.zeros(3)) or planner.plan(seen, np.zeros(3))
                rest = plan.pushes[1:]
                took.append(time.process_time() - began)
                for push in plan.pushes[: 1 if noisy else None]:
                    pose = pushed(table, pose, push.tip)
                if within(pose, 1.5):
                    break
            good += within(pose, 1.0 + noisy)
            numbers.append(looks if noisy else len(plan.pushes))
            misses.append(np.hypot(*pose[:2]) if plan.pushes else np.inf)
        print(
            f"{name}: {good} of {count} within {1 + noisy} mm and {1 + noisy}°; median miss"
            f" {1e3 * np.median(misses):.4f} mm; pushes {np.median(numbers):.0f};"
            f" CPU s a plan: median {np.median(took):.2f}, 95 % {np.quantile(took, 0.95):.2f}, most {np.max(took):.2f}",
            flush=True,
        )


if __name__ == "__main__":
    words = sys.argv[1:]
    main(
        next((int(w) for w in words if w.isdigit()), 50),
        "--noise" in words,
        [w for w in words if w in objects()],
    )
