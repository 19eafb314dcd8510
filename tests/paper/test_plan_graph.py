"""[Zhou2017] Sec. 5.1 and Figs. 6-9: the authors' stored graphs, searched again with their models.

Their path lengths were read off the last of 50 samples, which is 49/50 of the path (docs/errata.md), so that
stored costs are compared after taking the switching costs off and dividing by 0.98.
"""

import json

import numpy as np
import pytest

from flatpush.geometry import cross, transform
from flatpush.steering.fleet import Fleet

from .plan_graph import PlanGraph

SHORT = 49 / 50
STORED = 1e-6  # of a stored cost [m]: nodes and radii are stored with seven digits
NAMES = (
    "plan_graph_bigrect_mu03nd12_cs03",
    "plan_graph_butter_mu025nd10_cs05_vbhalfmm",
    "plan_graph_triangle_mu03nd15",
)


@pytest.fixture(scope="module", params=NAMES)
def stored(request, data_folder):
    """Document, arrays, our graph of the same poses, and queries of one stored graph."""
    folder = data_folder / "plan_graph"
    document = json.loads((folder / f"{request.param}.json").read_text())
    with np.load(folder / f"{request.param}.npz") as archive:
        arrays = {name: archive[name] for name in archive.files}
    graph = PlanGraph(stored_fleet(document), arrays["pose_nodes"], document["pose_goal"])
    queries = json.loads((folder / "requery_reference.json").read_text())[request.param]
    return document, arrays, graph, queries


def stored_fleet(document) -> Fleet:
    """Each action is a Dubins car of its rear axle with the heading +y of its push frame, which differs from action to
    action; poses are the object's."""
    left, right, direction, radii = [], [], [], []
    for action in document["push_actions"]:
        frame = np.array(action["push_frame_in_body"])  # origin: the rear axle
        ahead = frame[:2, 1] / np.linalg.norm(frame[:2, 1])
        aside = action["turning_radius"] * np.array([-ahead[1], ahead[0]])
        left.append(frame[:2, 2] + aside)
        right.append(frame[:2, 2] - aside)
        direction.append(ahead)
        radii.append(action["turning_radius"])
    k, R = len(radii), np.array(radii)
    free = np.full((k, 3), np.inf)
    rates = np.column_stack([R, np.ones(k), R])
    switching = document["cost_switch"] * (1 - np.eye(k))
    return Fleet(np.array(left), np.array(right), np.array(direction), rates, free, free, switching)


def test_the_stored_models_are_dubins_cars_of_their_own_frames(stored):
    document, _, graph, _ = stored
    assert graph.fleet.is_dubins
    assert len(np.unique(graph.fleet.heading.round(6))) == graph.fleet.size
    for a, action in enumerate(document["push_actions"]):
        # The push line goes from the contact ahead, within the friction cone.
        contact, cone = np.array(action["contact_point"]), [action["friction_left"], action["friction_right"]]
        ahead = graph.fleet.direction[a]
        assert -contact @ ahead > 0.99 * np.linalg.norm(contact)
        assert cross(cone[0], ahead) * cross(cone[1], ahead) < 0


def test_stored_costs_to_go_bound_ours(stored):
    """A stored cost counts 0.98 of the way: with the whole way the best is at most 1/0.98 of it, and at least it."""
    _, arrays, graph, _ = stored
    ours = graph.costs.T.ravel()
    assert np.all(ours >= arrays["dists"] - STORED)
    assert np.all(ours <= arrays["dists"] / SHORT + STORED)


def test_direct_ways_are_the_stored_ones_up_to_the_missing_sample(stored):
    _, arrays, graph, _ = stored
    direct = (arrays["prev_node"] == -1) & (graph.follow.T.ravel() == -1)
    assert direct.sum() > 700
    np.testing.assert_allclose(SHORT * graph.costs.T.ravel()[direct], arrays["dists"][direct], atol=STORED)


def test_nine_robot_queries(stored):
    """The push sequences of all robot logs, and their true costs."""
    document, _, graph, queries = stored
    for asked in queries:
        x, y, theta = asked["query_offset_mm_mm_rad"]
        way, single = graph.query(graph.goal + np.array([x / 1000, y / 1000, theta]))
        assert [p + 1 for p in way.pushes] == asked["actions"]
        changes = document["cost_switch"] * (len(asked["actions"]) - 1)
        assert way.cost == pytest.approx((asked["cost_toolbox_m"] - changes) / SHORT + changes, abs=STORED)
        np.testing.assert_allclose(way.legs, asked["segment_lengths_m"], atol=STORED)
        # The stated waypoints are object poses relative to the goal; angles to 0.01 degree.
        told = np.array(asked["waypoints_rel_goal_mm_mm_deg"])
        ours = way.poses - graph.goal
        np.testing.assert_allclose(1000 * ours[:, :2], told[:, :2], atol=2e-3)
        turn = np.rad2deg(ours[:, 2]) - told[:, 2]
        np.testing.assert_allclose((turn + 180) % 360 - 180, 0, atol=1e-2)
        assert single == pytest.approx(asked["best_direct_single_action_m"], abs=STORED)


def test_flat_points_move_by_the_length_of_a_leg_at_most(stored):
    """A leg is at least as long as its push's own flat point moves; other flat points move further on some legs."""
    _, _, graph, queries = stored
    further = 0
    for asked in queries:
        x, y, theta = asked["query_offset_mm_mm_rad"]
        way, _ = graph.query(graph.goal + np.array([x / 1000, y / 1000, theta]))
        legs = np.array(way.legs)
        for a in range(graph.fleet.size):
            moved = np.linalg.norm(np.diff(transform(way.poses, graph.fleet.flat_point[a]), axis=0), axis=1)
            own = np.array(way.pushes) == a
            assert np.all(moved[own] <= legs[own] + 1e-12)
            further += int(np.sum(moved[~own] > legs[~own]))
    assert further > 0
