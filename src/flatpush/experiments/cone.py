"""Two fingers with their composite cone against their virtual middle contact, on the paper's rectangle and triangle.

Random queries are planned with the cost of the pusher's way plus switching, with the same friction margin: a quarter of
the friction cone, and for the cone a quarter of the fingers' distance too. Every plan of the cone is rolled out with
both contacts, under the limit surface it was planned with, and must keep both from the first touch of each push to
its end.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..friction import Ellipsoid
from ..geometry.pose import Array
from ..planning import Planner
from ..planning.options import push_option
from ..problem import Object, Plan, Planning, Push, Pusher, Scene
from ..simulation import Noise, study

QUERIES, MARGIN = 60, 0.25
REACH = np.array([0.2083, 0.1095, np.pi])  # of the random starts about the goal
STILL = Noise(position=0.0, angle=0.0, friction=0.0)


@dataclass(frozen=True)
class Case:
    """An object of the paper, its limit surface diag(a, a, b) and where its sides are pushed [m]."""

    name: str
    corners: tuple[tuple[float, float], ...]
    surface: tuple[float, float]
    places: dict[str, tuple[float, float]]
    switching: float


CASES = (
    Case(
        "rectangle",
        ((-0.0255, -0.018), (0.0255, -0.018), (0.0255, 0.018), (-0.0255, 0.018)),
        (1.02150679, 1936.73374),
        {"left": (-0.0255, 0.0), "right": (0.0255, 0.0), "bottom": (0.0, -0.018), "top": (0.0, 0.018)},
        0.03,
    ),
    Case(
        "triangle",
        ((0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095)),
        (0.963910372, 2704.48587),
        {"long edge": (0.0, -0.0095), "short edge": (0.019667, 0.00475), "hypotenuse": (-0.003719, 0.007704)},
        0.01,
    ),
)


def scene(case: Case, start: Array, two_finger: str, margin: float) -> Scene:
    """A query: from a start to the origin, with both fingers, under one way to see them."""
    a, b = case.surface
    thing = Object(case.corners, "uniform", 0.3, Ellipsoid(np.diag([a, a, b])), name=case.name)
    pushes = [Push(name, thing.outline.nearest(place), 2, 0.018) for name, place in case.places.items()]
    planning = Planning(
        two_finger=two_finger,  # type: ignore[arg-type]
        cost="pusher",
        switch_cost=case.switching,
        friction_margin=margin,
        seed=1,
    )
    return Scene(
        thing, tuple(start), pusher=Pusher(2, 0.018, 0.0025), pushes=tuple(pushes), planning=planning
    )


def starts(count: int) -> Array:
    """The random starts, shape (count, 3)."""
    return REACH * np.random.default_rng(2017).uniform(-1, 1, (count, 3))


def kept(plan: Plan) -> bool:
    """Whether both contacts stick in every push of the plan, under its own surface, and it ends at its goal."""
    runs = study(plan, 1, noise=STILL)
    return bool(runs.sticking[0]) and bool(runs.errors[0, 0] < 1e-4)


def run(folder: Path | None = None, queries: int = QUERIES) -> str:
    """The table; with a folder, also the stable regions of both objects' pushes."""
    lines = [
        f"{queries} random queries each, friction margin {MARGIN}: way of the pusher + switching, mean [mm].",
        f"{'object':<10} {'radii, middle':>24} {'radii, cone':>24} {'middle':>8} {'cone':>8} {'shorter':>8}"
        f" {'middle, no margin':>18} {'shorter':>8} {'kept both':>10}",
    ]
    for case in CASES:
        costs: dict[tuple[str, float], list[float]] = {}
        good = 0
        for start in starts(queries):
            for way in (("middle", MARGIN), ("middle", 0.0), ("cone", MARGIN)):
                plan = Planner(scene(case, start, *way)).plan()
                costs.setdefault(way, []).append(plan.cost)
            good += kept(plan)
        middle, bare, cone = (1000 * float(np.mean(c)) for c in costs.values())
        lines.append(
            f"{case.name:<10} {_radii(case, 'middle'):>24} {_radii(case, 'cone'):>24} {middle:8.1f} {cone:8.1f}"
            f" {100 * (1 - cone / middle):6.1f} % {bare:18.1f} {100 * (1 - cone / bare):6.1f} %"
            f" {good:>5}/{queries}"
        )
        if folder is not None:
            _figure(case, folder / f"stable_{case.name}.svg")
    lines.append("radii of the flat point without margin [mm], one for each push")
    return "\n".join(lines)


def _radii(case: Case, two_finger: str) -> str:
    query = scene(case, np.zeros(3), two_finger, 0.0)
    assert not isinstance(query.pushes, str)
    cars = [push_option(query, push).car for push in query.pushes]
    return " ".join("—" if car is None else f"{1000 * car.radius:.1f}" for car in cars)


def _figure(case: Case, path: Path) -> None:
    from ..planning import describe
    from ..view import describe_figure
    from ..view.sketches import sketches

    query = scene(case, np.zeros(3), "cone", MARGIN)
    describe_figure(query, sketches(query, describe(query)), path)
