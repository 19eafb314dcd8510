"""Quality and time of refined plans of many pushes on random queries, next to the best single push.

`pytest benchmarks/test_refine.py -n 0 -s` prints the tables; FLATPUSH_QUERIES sets how many queries there are (at most
as many as have a best-known cost in refine_best.json). `python benchmarks/test_refine.py 200` searches for best-known
costs, which takes some seconds a query, and stores the lower of old and new ones. Nothing is asserted about time.

Models: the middle contacts of the paper's rectangle and triangle ([Zhou2017] Figs. 6 and 9), two fingers and no margin.
"""

import json
import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from flatpush.contact import PointContact
from flatpush.friction import Ellipsoid
from flatpush.planning.query import Query
from flatpush.planning.refine import refine
from flatpush.steering.car import Car
from flatpush.steering.fleet import Fleet

STORE = Path(__file__).with_name("refine_best.json")
GOAL = np.zeros(3)
REACH = np.array([0.2083, 0.1095, np.pi])  # of the random starts about the goal
ROUNDS = (1, 3, 40)  # about 0.03 s, 0.1 s and 1 s
MODELS = {  # a and b of diag(a, a, b), friction, switching cost, (point, normal) of every push
    "rectangle": (1.02150679, 1936.73374, 0.3, 0.03, [
        ((-0.028, 0.0), (1.0, 0.0)), ((0.028, 0.0), (-1.0, 0.0)),
        ((0.0, -0.0205), (0.0, 1.0)), ((0.0, 0.0205), (0.0, -1.0)),
    ]),
    "triangle": (0.963910372, 2704.48587, 0.3, 0.01, [
        ((0.0, -0.012), (0.0, 1.0)), ((0.022166667, 0.00475), (-1.0, 0.0)),
        ((-0.004808189, 0.009953794), (0.434962454, -0.90044859)),
    ]),
}  # fmt: skip


def fleet_of(name: str) -> Fleet:
    a, b, friction, switching, pushes = MODELS[name]
    surface = Ellipsoid(np.diag([a, a, b]))
    cars = [
        Car.of(PointContact(np.array(p), np.array(n) / np.linalg.norm(n), friction), surface)
        for p, n in pushes
    ]
    return Fleet.of(cars, np.array([car.weights("flat") for car in cars]), switching=switching)


def starts_of(count: int) -> np.ndarray:
    return REACH * np.random.default_rng(2017).uniform(-1, 1, (count, 3))


def columns(fleet: Fleet, start: np.ndarray) -> tuple[list[float], list[float]]:
    """Costs of the best single push and of ROUNDS of refinement, and the times of these [s]."""
    costs, times = [refine(Query(fleet, start, GOAL), rounds=0).cost], []
    for rounds in ROUNDS:
        begun = time.thread_time()
        costs.append(refine(Query(fleet, start, GOAL), rounds=rounds).cost)
        times.append(time.thread_time() - begun)
    return costs, times


def table(name: str, count: int) -> np.ndarray:
    """Gaps to the best known [%], shape (queries, 4); prints median and 95th percentile of each column."""
    best = np.array(json.loads(STORE.read_text())[name][:count])
    fleet = fleet_of(name)
    refine(Query(fleet, [0.1, 0.1, 1.0], GOAL), rounds=1)
    results = [columns(fleet, start) for start in starts_of(len(best))]
    costs = np.array([c for c, _ in results])
    times = np.array([t for _, t in results])
    gaps = 100 * (costs / best[:, None] - 1)
    print(f"\n{name}, {len(best)} queries; gap to the best known [%]: median, 95th percentile")
    for column, title in enumerate(("single push", *(f"{rounds} rounds" for rounds in ROUNDS))):
        spent = "" if column < 1 else f"   {1e3 * np.median(times[:, column - 1]):.0f} ms median"
        middle, far = np.percentile(gaps[:, column], (50, 95))
        print(f"  {title:14s} {middle:8.2f} {far:8.2f}{spent}")
    return gaps


@pytest.mark.parametrize("name", list(MODELS))
def test_quality(name):
    gaps = table(name, int(os.environ.get("FLATPUSH_QUERIES", "20")))
    assert np.all(gaps[:, 1] <= gaps[:, 0] + 1e-9)  # never worse than the best single push


@pytest.mark.parametrize("name", list(MODELS))
def test_query_time(benchmark, name):
    fleet, start = fleet_of(name), starts_of(1)[0]
    refine(Query(fleet, start, GOAL), rounds=1)
    benchmark.pedantic(refine, (Query(fleet, start, GOAL),), {"rounds": 3}, rounds=5, iterations=1)


def search_best(count: int) -> None:
    stored = json.loads(STORE.read_text()) if STORE.exists() else {}
    for name in MODELS:
        fleet, best = fleet_of(name), stored.get(name, [])
        for number, start in enumerate(starts_of(count)):
            cost = min(refine(Query(fleet, start, GOAL), rounds=50, seed=s).cost for s in (1, 2, 3))
            if number < len(best):
                best[number] = min(best[number], round(cost, 7))
            else:
                best.append(round(cost, 7))
        stored[name] = best
        STORE.write_text(json.dumps(stored) + "\n")


if __name__ == "__main__":
    search_best(int(sys.argv[1]))
