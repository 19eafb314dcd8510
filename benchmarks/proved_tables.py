"""What a proof for a set of tables buys: python benchmarks/proved_tables.py [OBJECTS] [DRAWS] [SEED].

Random objects on three to six feet, pushed by two fingers; loads within ± 20 %, finger friction from 80 % up. For each
object a plan that is proved for the set and one that holds on the nominal table only are rolled out in the plant, with
the exact surface of the drawn loads: first the vertices of the polytope of loads, then loads and friction from
inside the set. Counted are runs in which a finger slides or lets go after it first held.
"""

import sys
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

import flatpush as fp
from flatpush.simulation.rollout import roll

SHARE, LEAST = 0.2, 0.8  # of the loads; of the friction between finger and object
LIMIT = 0.05  # a start is within so many metres of the goal in x and in y


def thing(rng: np.random.Generator) -> fp.Object:
    """A polygon with feet on it."""
    angles = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 8)))
    while np.max(np.diff(angles, append=angles[0] + 2 * np.pi)) > 2.6:
        angles = np.sort(rng.uniform(0, 2 * np.pi, len(angles)))
    outline = 0.035 * np.stack([np.cos(angles), np.sin(angles)], axis=1) * rng.uniform(0.8, 1.2, 2)
    count = int(rng.integers(3, 7))
    feet = np.array([rng.dirichlet(np.ones(len(outline))) @ outline for _ in range(count)])
    support = fp.Support.points(feet, rng.uniform(0.7, 1.3, count))
    known = fp.Uncertainty(SHARE, (LEAST * 0.4, 0.4))
    return fp.Object(outline, support, friction=0.4, uncertainty=known)


def vertices(weights: np.ndarray) -> np.ndarray:
    """Loads at the ends of all ranges but one, which makes their sum right, shape (n, feet)."""
    found = []
    for k in range(len(weights)):
        for signs in product((-1.0, 1.0), repeat=len(weights) - 1):
            loads = weights * (1 + SHARE * np.insert(np.array(signs), k, 0.0))
            loads[k] += weights.sum() - loads.sum()
            if abs(loads[k] - weights[k]) <= SHARE * weights[k] + 1e-12:
                found.append(loads)
    return np.array(found)


def drawn(scene: fp.Scene, number: int, rng: np.random.Generator) -> list[fp.Scene]:
    """The scene on tables of the set: vertices first, then from inside."""
    points, weights = scene.object.support.feet
    ends = vertices(weights)
    scenes = []
    for i in range(number):
        if i < len(ends):
            loads, mu = ends[i], (LEAST, 1.0)[i % 2] * scene.object.friction
        else:
            mixed = rng.dirichlet(np.full(len(ends), 0.3)) @ ends
            loads, mu = mixed, rng.uniform(LEAST, 1.0) * scene.object.friction
        body = replace(scene.object, support=fp.Support.points(points, loads), friction=mu, uncertainty=None)
        scenes.append(replace(scene, object=body))
    return scenes


def failures(plan: Any, scenes: list[fp.Scene]) -> tuple[int, int]:
    """Runs that do not stick throughout, and runs that do not end."""
    rolled = roll(plan, scenes, "exact", "arcs")
    return int(np.sum(~rolled.sticking)), sum(word != "completed" for word in rolled.outcomes)


def main(objects: int = 50, draws: int = 200, seed: int = 0) -> None:
    rng = np.random.default_rng(seed)
    total = {kind: np.zeros(3, int) for kind in ("set", "nominal")}
    costs = []
    for k in range(objects):
        body = thing(rng)
        start = (*rng.uniform(-LIMIT, LIMIT, 2), rng.uniform(-np.pi, np.pi))
        pusher = fp.Pusher(fingers=2, spacing=0.014)
        plans = {}
        for kind in ("set", "nominal"):
            options = fp.Planning(proof=kind, iterations=300)
            plans[kind] = fp.plan(fp.Scene(body, start, pusher=pusher, planning=options))
        if plans["set"].status != "solved":
            print(f"object {k}: {plans['set'].reason}")
            continue
        costs.append(plans["set"].cost / plans["nominal"].cost)
        scenes = drawn(plans["set"].scene, draws, rng)
        for kind, plan in plans.items():
            slips, unended = failures(plan, scenes)
            total[kind] += slips, unended, slips > 0
            print(f"object {k}, {kind}: {slips} of {draws} slip, {unended} do not end", flush=True)
    for kind, (slips, unended, some) in total.items():
        runs = max(1, len(costs) * draws)
        print(
            f"{kind}: {slips} of {runs} runs slip ({100 * slips / runs:.1f} %), {unended} do not end;",
            end=" ",
        )
        print(f"{some} of {len(costs)} objects have a table that slips")
    if costs:
        print(f"a proved plan costs {np.median(costs):.2f} times the nominal one in the median")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
