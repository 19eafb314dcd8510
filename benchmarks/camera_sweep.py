"""Plans under feedback by camera: where they end, beside the open loop, and how much of the hand's limits they use.

    python benchmarks/camera_sweep.py [SEEDS] [PART OF AN EXAMPLE'S NAME] [CONTROLLER] [FRAME RATE]

Examples with two fingers, and disc, t_shape and a triangle with one; controllers path and dfl, and horizon where it
applies. "exact" and "late": without noise, the start as planned, with a frame in every tick and without delay, or 30
frames a second 100 ms late. Then the default camera (0.3 mm, 0.3°, 100 ms late) at 15 to 500 frames a second, the start
off by 0.5 mm in a random direction and by 0.5° to a random side, SEEDS (default 20) runs each; in the open loop the
same starts are rolled out. Printed are, of the distances and angles off the goal, median, 95 % and worst, the outcomes,
and of all runs the greatest share of each limit. Seeds and plans are the same each time.
"""

import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

import flatpush as fp
from flatpush.control import Camera
from flatpush.control.loop.closed_loop import limits_used
from flatpush.control.loop.limits import Limits
from flatpush.control.tracking.plan_controller import goal_error
from flatpush.control.tracking.simulated_run import TrackedRun

EXAMPLES = (
    "butterfly", "disc", "l_shape", "maze", "rectangle_boundary", "rectangle_three_feet", "t_shape", "triangle",
    "triangle_one_finger",
)  # fmt: skip
RATES = (15, 30, 60, 120, 500)
NOISELESS = {
    "exact": Camera(rate=60, latency=0.0, position=0.0, angle=0.0),
    "late": Camera(rate=30, latency=0.1, position=0.0, angle=0.0),
}
OFF, TURNED = 0.0005, np.deg2rad(0.5)


def start(seed: int) -> tuple[float, float, float]:
    """Where the object begins, off its place in the plan."""
    rng = np.random.default_rng([seed, 5])
    angle = rng.uniform(-np.pi, np.pi)
    return OFF * np.cos(angle), OFF * np.sin(angle), TURNED * rng.choice([-1.0, 1.0])


def row(name: str, ends: list[tuple[float, float]], outcomes: Counter[str], seconds: float) -> None:
    """Of ends [m, rad]."""
    off = np.array(ends) * (1000, 180 / np.pi)
    cells = [f"{d:8.3f} mm {a:7.3f}°" for d, a in np.quantile(off, [0.5, 0.95, 1.0], axis=0)]
    said = ", ".join(f"{n} {word}" for word, n in outcomes.most_common())
    print(f"  {name:<22}{'  '.join(cells)}  {seconds:6.1f} s  {said}", flush=True)


def rolled(plan: fp.Plan, seeds: range) -> None:
    """The open loop from the same starts."""
    scenes = [replace(plan.scene, start=plan.scene.start_pose + np.array(start(seed))) for seed in seeds]
    found = [fp.simulate(replace(plan, scene=scene)).final_pose for scene in scenes]
    row("open loop", [goal_error(plan, pose) for pose in found], Counter(), plan.duration)


def main(seeds: int, part: str, law: str, frames: str) -> None:
    shares: dict[str, float] = {}
    for name in EXAMPLES:
        if part not in name:
            continue
        plan = fp.plan(fp.load_scene(Path("examples") / f"{name}.yaml"))
        print(f"{name}: {len(plan.pushes)} pushes, {plan.duration:.1f} s", flush=True)
        rolled(plan, range(seeds))
        world, one = plan.scene.workspace, plan.scene.pusher.fingers == 1
        free = one and world.bounds is None and not world.obstacles
        for controller in ("path", "dfl", "horizon") if free else ("path", "dfl"):
            for rate in (*NOISELESS, *RATES):
                if law not in controller or frames not in ("", str(rate)):
                    continue
                ends, outcomes, seconds = [], Counter(), []
                for seed in range(1 if rate in NOISELESS else seeds):
                    asked = (
                        TrackedRun(controller, camera=NOISELESS[rate], tolerance=(5e-5, np.deg2rad(0.05)))
                        if rate in NOISELESS
                        else TrackedRun(controller, camera=Camera(rate=rate), start=start(seed), seed=seed)
                    )
                    run = asked.of(plan)
                    ends.append(goal_error(plan, run.object[-1]))
                    outcomes[run.outcome.split(":")[0]] += 1
                    seconds.append(run.times[-1])
                    limits = Limits.of(plan.scene.pusher, plan.pushes[0].fingers)
                    for key, share in limits_used(run, limits).items():
                        shares[key] = max(shares.get(key, 0.0), share)
                row(f"{controller}, {rate}", ends, outcomes, float(np.median(seconds)))
    print("most of each limit: " + ", ".join(f"{key} {share:.7f}" for key, share in shares.items()))


if __name__ == "__main__":
    given = sys.argv[1:] + ["20", "", "", ""][len(sys.argv) - 1 :]
    main(int(given[0]), given[1], given[2], given[3])
