"""How long proved plans are beside nominal ones and those of the paper's middle contact, everything else being equal.

`python benchmarks/proved_length.py [OBJECTS] [SEED] [ITERATIONS]`

Random objects and starts of proved_tables.py. All plans push at the same places, those of the proved one, with the same
fifth of friction in reserve (and, where each finger has its own contact, of their distance), which allows for fingers
from 80 % of the friction up: "set" besides for loads within ± 20 %, "nominal" and "middle" for one table. They are
measured by two rulers: the cost `flat`, which is the way of a point that each car has elsewhere, and `pusher`, the way
of the hand with its transits. Radii are the means over the pushes.
"""

import sys
from dataclasses import replace
from typing import Any

import numpy as np

import flatpush as fp
from proved_tables import LIMIT, SHARE, thing

KINDS: dict[str, dict[str, Any]] = {
    "set": {"proof": "set"},
    "nominal": {"proof": "nominal"},
    "middle": {"proof": "nominal", "two_finger": "middle"},
}


def lengths(
    scene: fp.Scene, kinds: dict[str, dict[str, Any]], iterations: int
) -> tuple[list[float], list[float]]:
    """Costs of the plans of each kind, infinite without one, and the mean turning radii [m]."""
    costs, radii = [], []
    for options in kinds.values():
        planner = fp.Planner(replace(scene, planning=fp.Planning(iterations=iterations, **options)))
        plan = planner.plan()
        costs.append(plan.cost if plan.status == "solved" else np.inf)
        cars = [option.car for option in planner.options if option.car is not None]
        radii.append(float(np.mean([car.radius for car in cars])) if cars else np.inf)
    return costs, radii


def main(objects: int = 20, seed: int = 0, iterations: int = 300) -> None:
    rng = np.random.default_rng(seed)
    found: dict[str, list[list[float]]] = {"flat": [], "pusher": [], "radius": []}
    for k in range(objects):
        body = replace(thing(rng), uncertainty=fp.Uncertainty(SHARE))
        start = (*rng.uniform(-LIMIT, LIMIT, 2), rng.uniform(-np.pi, np.pi))
        scene = fp.Scene(body, start, pusher=fp.Pusher(fingers=2, spacing=0.014))
        usable = fp.Planner(scene).usable
        if not usable:
            print(f"object {k}: nothing is proved")
            continue
        scene = replace(scene, pushes=tuple(option.push for option in usable))
        for cost in ("flat", "pusher"):
            costs, radii = lengths(
                scene, {name: {**one, "cost": cost} for name, one in KINDS.items()}, iterations
            )
            found[cost].append(costs)
            told = " / ".join(f"{1000 * x:.1f}" for x in costs)
            print(f"object {k}, {cost}: set / nominal / middle {told} mm", flush=True)
        found["radius"].append(radii)
    for name, rows in found.items():
        by_set, nominal, middle = np.array(rows).T
        ratios = (
            f"{np.median(by_set / nominal):.2f} times the nominal one, {np.median(by_set / middle):.2f} times"
        )
        less = f"less in {np.sum(by_set < middle)} of {len(rows)}"
        print(f"{name}: set {ratios} the middle contact's in the median, {less}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
