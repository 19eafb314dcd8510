"""[Zhou2017] Figs. 6-9: the nine robot queries with the authors' models, planned better than the stored plans."""

import json

import numpy as np
import pytest

from flatpush.experiments.stored_graphs import queries
from flatpush.planning.query import Query
from flatpush.planning.refine import refine

# What a prototype found [m, switching included]; ours may be 5 % above and is in fact nowhere above.
PROTOTYPE = {
    "plan_graph_bigrect_mu03nd12_cs03": (0.1474, 0.1064, 0.2256),
    "plan_graph_butter_mu025nd10_cs05_vbhalfmm": (0.1815, 0.1069, 0.2236),
    "plan_graph_triangle_mu03nd15": (0.1867, 0.0988, 0.3419),
}


def cases(data_folder):
    best = iter([cost for prototype in PROTOTYPE.values() for cost in prototype])
    for query in queries(data_folder):
        yield query.graph, query.fleet, query.start, query.cost, next(best)


def test_the_nine_robot_queries_are_planned_better(data_folder):
    compared = 0
    for name, fleet, start, stored, best in cases(data_folder):
        found = refine(Query(fleet, start, np.zeros(3)))
        assert found.cost <= 0.93 * stored, (name, start)
        assert found.cost <= 1.05 * best, (name, start)
        compared += 1
    assert compared == 9


def test_robust_plans_of_the_nine_queries_cost_little_more(data_folder):
    """Three percent, where the cheapest plans cost up to ten times as much to replan."""
    for name, fleet, start, _, best in cases(data_folder):
        found = refine(Query(fleet, start, np.zeros(3), robust=True))
        assert found.replanning_cost <= 1.05 * best, (name, start)
        assert found.replanning_cost == pytest.approx(found.cost, rel=5e-3)


def test_the_authors_own_sequences_are_improved_at_once(data_folder):
    """Their switch poses as the only seed, no other search: the descent alone."""
    from flatpush.planning.refine.problem import Candidate, Sequences

    folder = data_folder / "plan_graph"
    reference = json.loads((folder / "requery_reference.json").read_text())
    for name, fleet, start, stored, _ in cases(data_folder):
        (way,) = (
            w
            for w in reference[name]
            if np.allclose(np.array(w["query_offset_mm_mm_rad"]) * [1e-3, 1e-3, 1], start)
        )
        poses = np.array(way["waypoints_rel_goal_mm_mm_deg"]) * [1e-3, 1e-3, np.pi / 180]
        poses[0], poses[-1] = start, 0.0
        sequences = Sequences.of(Query(fleet, start, np.zeros(3)), 5e-3)
        seed = sequences.candidate(np.array(way["actions"]) - 1, poses)
        assert seed.cost == pytest.approx(stored, rel=2e-3)  # stored poses have few digits
        found = sequences.descend(Candidate(seed.cost, seed.pushes, seed.poses), 6, 80)
        assert found.cost < 0.97 * seed.cost
