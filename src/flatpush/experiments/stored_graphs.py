"""The nine robot queries of [Zhou2017] Figs. 6-9: the plans of the authors' stored graphs against refined ones.

Models, contacts and switching costs are as stored; the cost is the path of the flat point plus switching [m].
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..contact import PointContact
from ..errors import InputError
from ..friction import Ellipsoid
from ..geometry.pose import Array
from ..planning.query import Query
from ..planning.refine import refine
from ..steering.car import Car
from ..steering.fleet import Fleet
from .finding import Finding, Row

GRAPHS = {
    "plan_graph_bigrect_mu03nd12_cs03": "Figs. 6 and 7, rectangle",
    "plan_graph_butter_mu025nd10_cs05_vbhalfmm": "Fig. 8, butterfly",
    "plan_graph_triangle_mu03nd15": "Fig. 9, triangle",
}
SHORT = 0.98  # stored lengths miss the last of fifty steps


@dataclass(frozen=True, eq=False)
class StoredQuery:
    """A start of the robot's runs and the plan that the stored graph has for it.

    Attributes:
        graph: its name. fleet: the cars of its pushes. start: X_WO; the goal is the origin.
        cost: of the stored plan with its true length [m]. pushes: of it, from 0.
    """

    graph: str
    fleet: Fleet
    start: Array
    cost: float
    pushes: tuple[int, ...]


def stored_fleet(graph: Path) -> Fleet:
    """The cars of a stored graph's file: middle contacts, normals, a and b as stored; no margin."""
    document = json.loads(graph.read_text(encoding="utf-8"))
    cars = []
    for push in document["push_actions"]:
        surface = Ellipsoid(np.diag([push["a"], push["a"], push["b"]]))
        normal = np.array(push["inward_normal"])
        contact = PointContact(np.array(push["contact_point"]), normal / np.linalg.norm(normal), push["mu"])
        cars.append(Car.of(contact, surface))
    return Fleet.of(cars, np.array([car.weights("flat") for car in cars]), switching=document["cost_switch"])


def queries(data: Path) -> Iterator[StoredQuery]:
    """The nine, in the order of the figures.

    Raises:
        InputError: if the folder of recorded data has them not.
    """
    folder = data / "plan_graph"
    missing = [n for n in ("requery_reference", *GRAPHS) if not (folder / f"{n}.json").is_file()]
    if missing:
        raise InputError(f"stored graphs are missing: {', '.join(missing)}", source=str(folder))
    reference = json.loads((folder / "requery_reference.json").read_text(encoding="utf-8"))
    for name in GRAPHS:
        fleet = stored_fleet(folder / f"{name}.json")
        found = reference[name]
        if "butter" in name:  # the order of the figure, not of the file
            found = sorted(found, key=lambda q: q["query_offset_mm_mm_rad"][0])
        for query in found:
            pushes = tuple(int(a) - 1 for a in query["actions"])
            switching = float(fleet.switching[0, 1]) * (len(pushes) - 1)
            cost = (query["cost_toolbox_m"] - switching) / SHORT + switching
            start = np.array(query["query_offset_mm_mm_rad"]) * [1e-3, 1e-3, 1]
            yield StoredQuery(name, fleet, start, cost, pushes)


def find(quick: bool = False, data: Path | None = None) -> Finding:
    """A row for each query."""
    if data is None:
        return Finding(missing="The stored graphs are in the folder of recorded data (--data).")
    rows = []
    for query in queries(data):
        found = refine(Query(query.fleet, query.start, np.zeros(3)))
        x, y, turn = query.start * [1000, 1000, 180 / np.pi]
        rows.append(
            Row(
                f"{GRAPHS[query.graph]}, start ({x:.0f}, {y:.0f}, {turn:.0f}°)",
                f"{1000 * query.cost:.1f} mm, pushes {'-'.join(str(k + 1) for k in query.pushes)}",
                f"{1000 * found.cost:.1f} mm ({100 * (found.cost / query.cost - 1):+.0f} %)",
                "A graph of some thousand random poses is coarse; the same model is refined without them.",
            )
        )
    return Finding(tuple(rows))


def run(folder: Path | None = None, data: Path = Path()) -> str:
    """The rows; there is no figure."""
    return find(data=data).saved(folder)
