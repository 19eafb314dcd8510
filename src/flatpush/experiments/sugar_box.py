"""Two queries of "planning through contact", a convex relaxation that takes 93 s and 155 s on them (open solver).

A box of 106 × 185 mm on its whole face, one finger of radius 15 mm, friction 0.1, from their starts to the origin.
Their cost is another one, so only the times compare.
"""

import time
from pathlib import Path

import numpy as np

from ..planning import Planner
from ..problem import Object, Planning, Pusher, Scene
from ..simulation import simulate, verify

STARTS = ((0.029, 0.129, 0.644), (0.027, -0.046, 0.914))
THEIRS = (93.0, 155.0)


def scene(start: tuple[float, float, float], cost: str = "pusher") -> Scene:
    """The box with planar transits, so that the pusher's own way counts."""
    x, y = 0.053, 0.0925
    box = Object([(x, -y), (x, y), (-x, y), (-x, -y)], "uniform", 0.1, name="sugar box")
    pusher = Pusher(tip_radius=0.015, speed=0.05, transit="planar", approach=0.005)
    return Scene(box, start, pusher=pusher, planning=Planning(cost=cost))  # type: ignore[arg-type]


def run(folder: Path | None = None) -> str:
    """The table; with a folder, also a figure of each plan."""
    lines = [
        "One finger, μ = 0.1, box 106 × 185 mm; cost: way of the pusher, transits included.",
        f"{'start':>24} {'pushes':>28} {'cost':>9} {'time of plan':>13} {'planned in':>11} {'theirs':>7}",
    ]
    Planner(scene(STARTS[0])).plan()  # loads the compiled kernels
    for k, (start, theirs) in enumerate(zip(STARTS, THEIRS, strict=True)):
        began = time.perf_counter()
        plan = Planner(scene(start)).plan()
        took = time.perf_counter() - began
        words = " ".join(f"{p.push}:{p.word}" for p in plan.pushes)
        good = "" if verify(plan).ok and simulate(plan).outcome == "completed" else "  fails its check"
        pose = f"({1000 * start[0]:.0f}, {1000 * start[1]:.0f}, {np.rad2deg(start[2]):.1f}°)"
        ours = f"{1000 * plan.cost:6.1f} mm {plan.duration:11.1f} s {took:9.2f} s"
        lines.append(f"{pose:>24} {words:>28} {ours} {theirs:5.0f} s{good}")
        if folder is not None:
            from ..view import save_figure

            save_figure(plan, folder / f"sugar_box_{k + 1}.svg")
    return "\n".join(lines)
