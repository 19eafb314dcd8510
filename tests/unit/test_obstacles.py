"""The search among obstacles: its kernels against plain code, its ways against dense samples, what it says if none."""

import json
import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import flatpush as fp
from flatpush.geometry import Outline
from flatpush.geometry.collision import Body, World, path_clearance, pose_clearance
from flatpush.planning.empty_table import direct_paths
from flatpush.planning.obstacles import Search, query_of
from flatpush.planning.obstacles.lattice import Lattice, Level, Reach
from flatpush.planning.obstacles.polish import Chain
from flatpush.planning.obstacles.trees import Trees
from flatpush.planning.path import Path, pieces_of
from flatpush.planning.query import Query

from ..maze import EXAMPLE, MAZE_A, MAZE_B, check_way, dense_clearance, maze_query, maze_scene, stored_query

NEED = 1.5e-5


@pytest.fixture(scope="module")
def query():
    return maze_query(NEED)


def searched(query, seed, work):
    search = Search(query, seed)
    for _ in search.rounds():
        if search.work >= work:
            break
    return search


def test_compiled_edges_keep_clear_where_their_displacements_do(query):
    from flatpush.planning.obstacles.kernels import word_clear
    from flatpush.steering.six_words import WORD

    rng = np.random.default_rng(1)
    T, fleet, drawn = query.arrays, query.fleet, np.zeros(1, WORD)
    decided = {True: 0, False: 0}
    while sum(decided.values()) < 30:
        a = int(rng.integers(fleet.size))
        start = rng.uniform([0, 0, -3], [0.32, 0.25, 3])
        if pose_clearance(query.world, query.bodies[a], start) < query.clearance:
            continue
        letters, amounts = rng.integers(0, 3, 3), rng.uniform(0.0, 0.08, 3)
        drawn["letter"], drawn["amount"] = letters, amounts * np.where(letters == 1, 0.5, 6.0)
        way = Path.of(fleet, start, pieces_of(a, drawn[0]))
        steps = [way.step(*piece) for piece in way.pieces]
        gap = path_clearance(query.world, query.bodies[a], start, steps).distance
        decided[bool(word_clear(T, a, start, drawn, 0))] += 1
        assert word_clear(T, a, start, drawn, 0) == (gap >= query.clearance)
    assert min(decided.values()) > 5


def found(lattice: Lattice) -> Path:
    """The last way that a search finds."""
    ways: list[Path] = []
    while not lattice.done:
        ways += lattice.advance(100, np.inf)
    return ways[-1]


def test_a_lattice_finds_the_maze_at_once_and_its_way_is_free(query):
    lattice = Lattice(query, Reach(query), Level(0.02, 16, 0.03), np.inf, np.random.default_rng(0))
    way = found(lattice)
    assert way.cost == pytest.approx(lattice.queue.bound[0])
    assert way.cost < 0.8
    check_way(query, way)


def test_backwards_is_the_same_way(query):
    back = query.reversed
    lattice = Lattice(back, Reach(back), Level(0.015, 24, 0.02), np.inf, np.random.default_rng(0))
    back_way = found(lattice)
    way = back_way.backwards(query.fleet, query.start)
    assert way.cost == pytest.approx(back_way.cost)
    check_way(query, way)


def test_polish_shortens_and_stays_free(query):
    lattice = Lattice(query, Reach(query), Level(0.02, 16, 0.03), np.inf, np.random.default_rng(0))
    way = found(lattice)
    chain = Chain(query, way, 3)
    assert chain.cost <= way.cost + 1e-12
    for _ in range(5):
        chain.improve(500)
        check_way(query, chain.path)
        assert chain.path.cost <= chain.cost + 1e-12
    assert chain.cost < 0.98 * way.cost


def test_random_trees_find_a_first_way(query):
    for seed in range(4):
        trees = Trees(query, seed)
        if trees.path is not None:
            check_way(query, trees.path)
    one, two = Trees(query, 7), Trees(query, 7)
    assert one.path is not None
    assert one.path.pieces == two.path.pieces
    # Where a word leads straight to the goal, it is found without any tree.
    near = replace(query, goal=Path.of(query.fleet, query.start, [(1, 1, 0.01), (1, 0, 0.2)]).poses[-1])
    assert Trees(near, 0, 3).work <= 3
    assert Trees(near, 0, 3).path is not None
    assert Trees(query, 0, 3).path is None


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
def test_the_robot_maze_is_solved_and_improved(query, seed):
    """The stored plan costs 0.862; after some tenths of a second ours cost what a prototype's took longer to reach."""
    search = Search(query, seed)
    first = next(way for way in search.rounds() if way is not None)
    assert search.work < 3000
    check_way(query, first)
    search = searched(query, seed, 60_000)
    assert search.cost <= 0.685
    check_way(query, search.best)


def test_same_seed_and_work_same_way(query):
    one, two = searched(query, 5, 40_000), searched(query, 5, 40_000)
    assert one.best.pieces == two.best.pieces


@pytest.mark.slow
def test_every_stored_maze_is_solved_and_cheaper_than_its_stored_plan(data_folder):
    """All twelve, read from their files; the stored plans of some of them touch the walls."""
    stored = json.loads((data_folder / "maze" / "stored_paths_clearance_check.json").read_text())
    assert len(stored) == 12
    for row in stored:
        query = stored_query(data_folder, row["maze"], need=NEED)
        search = searched(query, 0, 20_000)
        check_way(query, search.best)
        changes = sum(a != b for a, b in pairwise(row["actions"]))
        assert search.cost < row["total_length_m"] + changes * query.fleet.switching.max()


@pytest.mark.slow
@pytest.mark.parametrize("name", [MAZE_A, MAZE_B])
def test_narrow_passages_of_the_robot_mazes_are_found(data_folder, name):
    """Maze B: 0.62 with one change of push was known, and 0.423 without any."""
    query = stored_query(data_folder, name, need=NEED)
    search = searched(query, 1, 400_000)
    check_way(query, search.best)
    assert search.cost <= {MAZE_A: 0.55, MAZE_B: 0.62}[name]


def body_steps(segment):
    return [arc.duration * np.asarray(arc.twist) for arc in segment.arcs]


def test_the_planner_plans_the_maze_with_a_certificate():
    seen = []
    planner = fp.Planner(maze_scene(), progress=lambda *told: seen.append(told))
    answers = list(planner.answers())
    costs = [answer.cost for answer in answers]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] < 0.6
    plan = answers[-1].plan()
    assert plan.status == "solved"
    assert fp.verify(plan).ok
    assert plan.cost == pytest.approx(costs[-1], rel=1e-6)
    assert plan.certificate.clearance >= 0
    world = World.of(plan.scene.workspace.bounds, plan.scene.workspace.obstacles)
    placements = {o.push.name: o.placement for o in planner.options}
    for segment in plan.pushes:
        body = Body.of(plan.scene.object.outline, placements[segment.push].tips, plan.scene.pusher.tip_radius)
        assert dense_clearance(world, body, segment.object[0], body_steps(segment)) >= 0
    assert len(seen) > 5
    assert seen[-1][0] <= costs[0]
    explored = planner.explored
    assert explored.ndim == 3
    assert 100 < len(explored) <= 2000


def test_plans_among_obstacles_repeat():
    scene = maze_scene(seed=2)
    scene = replace(scene, planning=replace(scene.planning, iterations=30))
    one, two = (fp.Planner(scene).plan() for _ in range(2))
    assert one.cost == two.cost
    assert [s.word for s in one.pushes] == [s.word for s in two.pushes]


def test_an_interrupt_passes_through():
    def interrupt(cost, clock, poses):
        if np.isfinite(cost):
            raise KeyboardInterrupt

    planner = fp.Planner(maze_scene(), progress=interrupt)
    answers = planner.answers()
    kept = next(answers)
    with pytest.raises(KeyboardInterrupt):
        list(answers)
    assert kept.plan().status == "solved"


def test_walled_in_goals_end_with_words():
    scene = maze_scene()
    wall = np.array([(0.0, 0.06), (0.23, 0.06), (0.23, 0.0886), (0.0, 0.0886)])
    closed = replace(scene, workspace=replace(scene.workspace, obstacles=(*scene.workspace.obstacles, wall)))
    plan = fp.Planner(closed).plan()
    assert plan.status == "no_plan"
    assert plan.reason.startswith("the object does not fit through from the start to the goal")
    assert "nothing gets through at all" in plan.reason
    # Told how wide the widest way is: a slit of 12 mm, with 1 mm of clearance on either side.
    parts = [
        np.array([(a, 0.06), (b, 0.06), (b, 0.0886), (a, 0.0886)]) for a, b in ((0.0, 0.08), (0.092, 0.23))
    ]
    slit = replace(scene, workspace=replace(scene.workspace, obstacles=(*scene.workspace.obstacles, *parts)))
    reason = fp.Planner(slit).plan().reason
    told = re.search(r"no way is wider than ([\d.]+) mm", reason)
    assert float(told[1]) == pytest.approx(12.0 - 2 * 1000 * scene.planning.clearance, abs=0.1)
    # And where: in the middle of the slit, between the two walls.
    spot = re.search(
        r"narrowest at \(([-\d.]+), ([-\d.]+)\) mm, between obstacle (\d+) and obstacle (\d+)\.", reason
    )
    assert float(spot[1]) == pytest.approx(86.0, abs=0.1)
    assert 60.0 < float(spot[2]) < 88.6
    count = len(scene.workspace.obstacles)
    assert {int(spot[3]), int(spot[4])} == {count, count + 1}
    # A slit that a disc inside the object passes, but not the object with fingers.
    gap = np.array([(0.0, 0.06), (0.078, 0.06), (0.078, 0.0884), (0.0, 0.0884)])
    other = np.array([(0.104, 0.06), (0.23, 0.06), (0.23, 0.0884), (0.104, 0.0884)])
    tight = replace(
        scene, workspace=replace(scene.workspace, obstacles=(*scene.workspace.obstacles, gap, other))
    )
    plan = fp.Planner(tight).plan()
    assert plan.status == "no_plan"
    assert "poses were searched from the start and from the goal" in plan.reason


def test_a_start_in_collision_is_named():
    scene = replace(maze_scene(), start=(0.2, 0.15, 0.0))
    with pytest.raises(fp.InputError, match="at the start the object crosses obstacle 0"):
        fp.Planner(scene).plan()


def test_where_nothing_is_in_the_way_the_plan_is_that_without_obstacles():
    scene = replace(maze_scene(), start=(0.08, -0.05, 2.0), goal=(0.0, 0.0, 0.0))
    free = replace(scene, workspace=fp.Workspace())
    far = np.array([(0.5, 0.5), (0.6, 0.5), (0.6, 0.6)])
    kept = fp.Planner(replace(scene, workspace=fp.Workspace(None, (far,)))).plan()
    assert kept.cost <= fp.Planner(free).plan().cost * (1 + 1e-3)


def crossing(robust=False) -> Query:
    """A triangle that is turned beside a block by two pushes, whose cheapest switch pose sits on a jump."""
    scene = fp.load_scene(EXAMPLE.with_name("triangle.yaml"))
    block = np.array([(-0.06, -0.09), (-0.03, -0.09), (-0.03, -0.06), (-0.06, -0.06)])
    planner = fp.Planner(
        replace(
            scene,
            start=(0.06, 0.02, 2.6),
            workspace=fp.Workspace((-0.3, -0.3, 0.3, 0.3), (block,)),
            planning=replace(scene.planning, switch_cost=0.01, robust=robust),
        )
    )
    return query_of(planner.scene, planner.usable, planner.fleet)


def replanned_plainly(query, path):
    """Mean over the sixteen displacements of each switch pose of the cheapest of the plain words that keep clear."""
    total = path.cost
    for i in range(1, len(path.pieces)):
        push = path.pieces[i][0]
        if push == path.pieces[i - 1][0]:
            continue
        leg = [piece for piece in path.pieces[i : i + 3] if piece[0] == push]
        total -= Path(path.fleet, path.poses[i], tuple(leg)).cost
        for at in np.arange(8) * np.pi / 4:
            for turn in np.deg2rad([0.2, -0.2]):
                off = path.poses[i] + [2e-4 * np.cos(at), 2e-4 * np.sin(at), turn]
                again = [path.cost]
                for word in direct_paths(
                    path.fleet, off, np.tile(path.poses[i + len(leg)], (path.fleet.size, 1))
                ):
                    if word.pushes != (push,) or word.cost >= min(again):
                        continue
                    steps = [word.step(*piece) for piece in word.pieces]
                    if (
                        path_clearance(query.world, query.bodies[push], off, steps).distance
                        >= query.clearance
                    ):
                        again.append(word.cost)
                total += min(again) / 16
    return total


@pytest.fixture(scope="module")
def robust():
    return searched(crossing(robust=True), 0, 20_000)


def test_robust_paths_cost_little_more_and_replan_cheaply(robust):
    nominal = searched(crossing(), 0, 20_000)
    assert nominal.cost == nominal.best.cost
    judge = robust.value(nominal.best)
    assert judge == pytest.approx(replanned_plainly(robust.query, nominal.best), rel=1e-9)
    assert judge > 1.5 * nominal.cost
    assert robust.cost == pytest.approx(replanned_plainly(robust.query, robust.best), rel=1e-9)
    assert robust.cost < 1.01 * nominal.cost
    check_way(robust.query, robust.best)


def test_an_attempt_at_a_switch_pose_that_touches_is_lost(robust):
    """A block that leaves no room for the sixteen displacements of the switch pose: half of them or more are lost."""
    query, path = robust.query, robust.best
    body, pose = (
        query.bodies[path.pushes[1]],
        path.poses[next(i for i in range(len(path.pieces)) if path.pieces[i][0] != path.pushes[0])],
    )
    room = pose_clearance(query.world, body, pose)
    tight = replace(query, clearance=room - 1e-9)
    assert Search(tight, 0).value(path) == pytest.approx(replanned_plainly(tight, path), rel=1e-9)
    assert Search(tight, 0).value(path) > path.cost + 0.25 * path.cost


def test_robust_is_planned_among_obstacles():
    plan = fp.Planner(maze_scene(robust=True)).plan()
    assert plan.status == "solved"
    assert fp.verify(plan).ok
    assert plan.run["replanning_cost"] >= plan.cost * (1 - 1e-6)
    assert plan.certificate.clearance >= 0


def test_offered_ways_must_be_free(query):
    search = searched(query, 0, 5000)
    other = Search(query, 1)
    assert other.offer(search.best)
    assert other.cost <= search.cost
    through = Path.of(query.fleet, query.start, [(1, 1, 0.3)])
    assert not other.offer(through)


def test_round_objects_and_obstacles():
    thing = fp.Object(Outline.circle(0.02), "uniform", friction=0.4)
    scene = fp.Scene(
        thing,
        (0.0, 0.0, 0.0),
        (0.3, 0.0, 0.5),
        pusher=fp.Pusher(),
        workspace=fp.Workspace(
            (-0.1, -0.12, 0.4, 0.12),
            (np.array([(0.1, -0.02), (0.2, -0.03), (0.15, 0.06)]), Outline.circle(0.03, (0.22, 0.0))),
        ),
        planning=fp.Planning(time_limit=60, iterations=300),
    )
    plan = fp.Planner(scene).plan()
    assert plan.status == "solved"
    assert plan.certificate.clearance >= 0
    assert fp.verify(plan).ok
    least = min(np.min(np.hypot(*(s.object[:, :2] - (0.22, 0.0)).T)) for s in plan.pushes)
    assert 0.05 <= least < 0.1


def test_pruned_paths_have_fewer_pieces_and_cost_hardly_more(query):
    from flatpush.planning.obstacles import pruned

    fewer = 0
    for way in (trees.path for trees in (Trees(query, seed) for seed in range(8)) if trees.path is not None):
        tidy = pruned(query, way)
        check_way(query, tidy)
        gone = len(way.pieces) - len(tidy.pieces)
        assert gone >= 0
        assert tidy.pushes == way.pushes
        assert tidy.cost <= way.cost * (1 + 5e-4 * gone) + 1e-12
        fewer += gone
    assert fewer > 0
    # A needless wiggle on a straight way becomes the straight way again.
    near = Path.of(
        query.fleet, query.start, [(1, 1, 0.01), (1, 0, 1e-3), (1, 2, 1e-3), (1, 0, 1e-3), (1, 1, 0.004)]
    )
    assert len(pruned(query, near).pieces) <= 3
