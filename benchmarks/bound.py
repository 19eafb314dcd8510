"""How near the lower bound on the cost comes to the best plan.

`python benchmarks/bound.py [QUERIES] [SECONDS] [MODEL] [FIRST]`

Random starts of test_refine.py: the paper's rectangle or triangle as Dubins cars ("rectangle", "triangle"), or the
rectangle with two fingers and their cone ("cone"). The gap is that between the best plan known, of the quick search or
of the bound's own, and the bound, after 1, 3 and 10 s of CPU time of one core: against plans of at most one change of
contact, and against plans of any number. With stored best-known costs it is checked that no bound is above one.
"""

import json
import sys
import time

import numpy as np

import flatpush as fp
from flatpush.planning.bound import bounds
from flatpush.planning.query import Query
from flatpush.planning.refine import refine
from flatpush.steering.fleet import Fleet
from test_refine import GOAL, STORE, fleet_of, starts_of

MARKS = (1.0, 3.0, 10.0)  # CPU time [s]
RECTANGLE = [(0.028, -0.0205), (0.028, 0.0205), (-0.028, 0.0205), (-0.028, -0.0205)]


def cone_fleet() -> Fleet:
    """The rectangle on its rim, pushed by two fingers at all four sides."""
    body = fp.Object(RECTANGLE, "outline", friction=0.3)
    scene = fp.Scene(body, (0.1, 0.0, 0.0), pusher=fp.Pusher(fingers=2, spacing=0.018))
    return fp.Planner(scene).fleet


def gaps_of(query: Query, seconds: float) -> tuple[np.ndarray, float, float, bool]:
    """Gaps to plans of one change and of any, shape (marks, 2); best cost, bound, whether that found it."""
    quick = refine(query, rounds=3)
    marks = [mark for mark in MARKS if mark <= seconds]
    found: list[tuple[float, float]] = []
    began = time.process_time()
    for bound in bounds(query, quick.cost):
        best = quick.cost if bound.found is None else bound.found.cost
        gaps = best / bound.least[0] - 1, best / bound.least_of_all - 1
        took = time.process_time() - began
        while len(found) < len(marks) and took >= marks[len(found)]:
            found.append(gaps)
        if len(found) == len(marks):
            break
    found += [gaps] * (len(marks) - len(found))  # nothing was left to do
    return np.array(found), best, bound.least_of_all, bound.found is not None


def main(queries: int = 200, seconds: float = 10.0, model: str = "rectangle", first: int = 0) -> None:
    fleet = cone_fleet() if model == "cone" else fleet_of(model)
    stored = json.loads(STORE.read_text()).get(model, []) if STORE.exists() else []
    gaps, better = [], 0
    starts = starts_of(200)
    warm = Query(fleet, starts[0], GOAL)
    refine(warm, rounds=1)
    next(bounds(warm, 1.0))
    for k in range(first, first + queries):
        found, best, least, improved = gaps_of(Query(fleet, starts[k], GOAL), seconds)
        gaps.append(found)
        better += improved
        above = k < len(stored) and least > stored[k] + 1e-7  # as they are rounded
        shown = ", ".join(f"{100 * a:.2f}/{100 * b:.2f}" for a, b in found)
        print(
            f"query {k}: {1000 * best:.1f} mm, gaps {shown} %{' ABOVE THE BEST KNOWN' if above else ''}",
            flush=True,
        )
    table = 100 * np.array(gaps)
    for i, mark in enumerate(mark for mark in MARKS if mark <= seconds):
        one, every = table[:, i].T
        print(
            f"{mark:g} s: one change median {np.median(one):.2f} %, worst {one.max():.2f} %; any number median"
            f" {np.median(every):.2f} %, worst {every.max():.2f} %, within 1 %: {np.sum(every <= 1)} of {len(every)}"
        )
    print(f"a cheaper plan was found in {better} of {len(table)}")


if __name__ == "__main__":
    given = sys.argv[1:]
    main(*(kind(value) for kind, value in zip((int, float, str, int), given, strict=False)))
