"""The multi-push tree: what it promises, how it is stored, what it refuses."""

import dataclasses
import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from flatpush.documents import tree_file
from flatpush.errors import InputError
from flatpush.planning.graph import Tree, build_tree, pose_samples, query, stored_tree, tree_key
from flatpush.steering.fleet import Fleet

GOAL = np.array([0.1, -0.2, 0.5])
SAME = 1e-12  # the same sums in another order


def fleet_of(k: int, switching: float = 0.03, tilt: float = 0.0) -> Fleet:
    """Pushes from all sides; with a tilt no Dubins cars."""
    turn = 2 * np.pi * np.arange(k) / k + 0.3
    ahead = np.column_stack([np.cos(turn), np.sin(turn)])
    across = np.column_stack([-np.sin(turn), np.cos(turn)])
    R = 0.05 + 0.01 * np.arange(k)
    rates = np.column_stack([R, np.ones(k), R])
    free = np.full((k, 3), np.inf)
    direction = np.column_stack([np.cos(turn + tilt), np.sin(turn + tilt)])
    cost = switching * (1 - np.eye(k))
    return Fleet(
        0.02 * ahead + R[:, None] * across,
        0.02 * ahead - R[:, None] * across,
        direction,
        rates,
        free,
        free,
        cost,
    )


def chosen(fleet: Fleet, pushes) -> Fleet:
    some = {
        f.name: getattr(fleet, f.name)[pushes] for f in dataclasses.fields(fleet) if f.name != "switching"
    }
    return Fleet(**some, switching=fleet.switching[np.ix_(pushes, pushes)])


POSES = pose_samples(150, GOAL, 0.2, seed=1)
STARTS = pose_samples(25, GOAL, 0.15, seed=2)


@pytest.fixture(scope="module", params=[0.0, 0.2], ids=["dubins", "tilted"])
def tree(request) -> Tree:
    return build_tree(fleet_of(3, tilt=request.param), POSES, GOAL)


def test_samples_are_spread_denser_near_the_goal_and_repeatable():
    poses = pose_samples(3000, GOAL, [-0.1, -0.3, 0.3, 0.0], seed=4)
    assert np.array_equal(poses, pose_samples(3000, GOAL, [-0.1, -0.3, 0.3, 0.0], seed=4))
    assert np.array_equal(poses[:1000], pose_samples(1000, GOAL, [-0.1, -0.3, 0.3, 0.0], seed=4))
    assert not np.array_equal(poses, pose_samples(3000, GOAL, [-0.1, -0.3, 0.3, 0.0], seed=5))
    assert np.all((poses[:, :2] >= [-0.1, -0.3]) & (poses[:, :2] <= [0.3, 0.0]))
    assert np.all((poses[:, 2] > -np.pi) & (poses[:, 2] <= np.pi))
    cells = np.histogramdd(poses, bins=(4, 4, 4))[0]
    assert cells.min() > 0.25 * 3000 / 64  # no hole
    near = np.all(np.abs(poses[:, :2] - GOAL[:2]) < 0.25 * np.array([0.2, 0.15]), axis=1)
    assert near.mean() > 2 / 16  # an even density has 1/16 there


@pytest.mark.parametrize(
    ("goal", "region", "count"),
    [((0, 0), 0.1, 5), ((0, 0, np.nan), 0.1, 5), ((0, 0, 0), [0.1, 0, 1, 1], 5), ((0, 0, 0), np.inf, 5),
     ((0, 0, 0), -1.0, 5), ((0, 0, 0), [0, 1], 5), ((0, 0, 0), 0.1, -1)],
)  # fmt: skip
def test_bad_regions_are_refused(goal, region, count):
    with pytest.raises(InputError):
        pose_samples(count, goal, region)


def test_ways_are_sorted_distinct_and_add_up(tree):
    for start in STARTS:
        ways = query(tree, start)
        assert [w.cost for w in ways] == sorted(w.cost for w in ways)
        merged = [tuple(p for p, q in zip(w.pushes, (None, *w.pushes), strict=False) if p != q) for w in ways]
        assert len(set(merged)) == len(merged)
        assert any(len(w.pushes) == 1 for w in ways)
        for w in ways:
            assert np.array_equal(w.poses[0], start)
            assert np.array_equal(w.poses[-1], GOAL)
            assert len(w.poses) == len(w.pushes) + 1 == len(w.legs) + 1
            changes = sum(tree.fleet.switching[a, b] for a, b in pairwise(w.pushes))
            assert w.cost == pytest.approx(w.legs.sum() + changes, abs=SAME)


def test_legs_of_dubins_cars_change_the_push(tree):
    if tree.fleet.is_dubins:
        for start in STARTS:
            for w in query(tree, start):
                assert all(a != b for a, b in pairwise(w.pushes))


def test_the_best_single_push_is_always_there(tree):
    for start in STARTS:
        everything = query(tree, start, 1000)
        single = min(w.cost for w in everything if len(w.pushes) == 1)
        few = query(tree, start, 2)
        assert len(few) == 2
        assert any(len(w.pushes) == 1 and w.cost == single for w in few)
        assert query(tree, start, 3)[0].cost == everything[0].cost


def test_more_pushes_are_never_worse():
    fleet = fleet_of(4)
    trees = [build_tree(chosen(fleet, list(range(k))), POSES, GOAL) for k in (1, 2, 3, 4)]
    for small, large in pairwise(trees):
        assert np.all(large.arrived[: small.fleet.size] <= small.arrived + SAME)
        for start in STARTS:
            assert query(large, start, 1)[0].cost <= query(small, start, 1)[0].cost + SAME
    assert any(query(trees[3], s, 1)[0].cost < query(trees[0], s, 1)[0].cost - 0.1 for s in STARTS)


def test_a_push_listed_twice_changes_nothing(tree):
    twice = build_tree(chosen(tree.fleet, [0, 1, 2, 1]), POSES, GOAL)
    np.testing.assert_allclose(twice.arrived[:3], tree.arrived, atol=SAME)
    for start in STARTS:
        assert query(twice, start, 1)[0].cost == pytest.approx(query(tree, start, 1)[0].cost, abs=SAME)


def test_costs_obey_the_triangle_inequality_of_the_graph(tree):
    """No edge into any pose is a short cut: V(j, a) ≤ edge + W(i, a), but for pushes back to where they began."""
    from flatpush.planning.graph import leg_cost

    rng = np.random.default_rng(3)
    for a, j, i in zip(*(rng.integers(0, m, 300) for m in (3, 150, 150)), strict=True):
        if i != j and tree.follow[a, i] != j:
            most = leg_cost(tree.fleet, a, POSES[j], POSES[i]) + tree.arrived[a, i]
            assert tree.costs[a, j] <= most + 1e-9
    most = np.min(tree.costs[None] + tree.fleet.switching[:, :, None], axis=1)
    np.testing.assert_allclose(tree.arrived, most, atol=SAME)


def test_dearer_switches_are_made_less_often():
    changes = []
    for cost in (0.0, 0.01, 0.05, 1.0):
        tree = build_tree(fleet_of(3, cost), POSES, GOAL)
        changes.append(sum(len(query(tree, s, 1)[0].pushes) - 1 for s in STARTS))
    assert changes == sorted(changes, reverse=True)
    assert changes[0] > 20
    assert changes[-1] == 0


def test_a_forbidden_switch_is_not_made():
    fleet = fleet_of(3, 0.001)
    one_way = np.where((np.arange(3)[:, None] == 0) & (np.arange(3) == 1), np.inf, fleet.switching)
    tree = build_tree(dataclasses.replace(fleet, switching=one_way), POSES, GOAL)
    ways = [w for s in STARTS for w in query(tree, s)]
    assert all((a, b) != (0, 1) for w in ways for a, b in pairwise(w.pushes))
    free = build_tree(fleet, POSES, GOAL)
    assert any(w.pushes[:2] == (0, 1) for s in STARTS for w in query(free, s))


def test_no_pose_one_pose_and_the_goal_itself():
    fleet = fleet_of(2)
    for poses in (np.empty((0, 3)), GOAL[None], np.vstack([GOAL, GOAL, POSES[:2], POSES[:2]])):
        tree = build_tree(fleet, poses, GOAL)
        assert query(tree, GOAL)[0].cost == pytest.approx(0.0, abs=1e-12)
        assert len(query(tree, POSES[0])[0].pushes) == 1 or len(poses) > 2


def test_free_switches_between_poses_that_coincide_end():
    poses = np.vstack([POSES[:20], POSES[:20], POSES[:20]])
    tree = build_tree(fleet_of(3, 0.0), poses, GOAL)
    once = build_tree(fleet_of(3, 0.0), POSES[:20], GOAL)
    np.testing.assert_allclose(tree.arrived[:, :20], once.arrived, atol=SAME)
    assert all(np.isfinite(w.cost) for s in STARTS for w in query(tree, s))


@pytest.mark.parametrize("bad", [-0.1, np.nan])
def test_bad_switching_costs_are_refused(bad):
    fleet = fleet_of(2)
    costs = fleet.switching.copy()
    costs[0, 1] = bad
    with pytest.raises(InputError, match="switching"):
        build_tree(dataclasses.replace(fleet, switching=costs), POSES, GOAL)


def test_bad_poses_and_no_pushes_are_refused(tree):
    with pytest.raises(InputError, match="push"):
        build_tree(chosen(fleet_of(2), []), POSES, GOAL)
    for poses, goal in ((POSES * np.nan, GOAL), (POSES, GOAL[:2])):
        with pytest.raises(InputError, match="pose"):
            build_tree(fleet_of(2), poses, goal)
    for start in ((0, 0), (0, np.inf, 0)):
        with pytest.raises(InputError, match="pose"):
            query(tree, start)


# Stored trees


def same(a: Tree, b: Tree) -> bool:
    return all(np.array_equal(a.arrays[name], b.arrays[name]) for name in a.arrays)


def test_the_key_is_of_all_that_a_tree_depends_on():
    fleet = fleet_of(3)
    key = tree_key(fleet, POSES, GOAL)
    assert key == tree_key(fleet_of(3), POSES.copy(), list(GOAL)) == build_tree(fleet, POSES, GOAL).key
    others = [tree_key(fleet, POSES[:-1], GOAL), tree_key(fleet, POSES, GOAL + 1e-9)]
    for field in dataclasses.fields(fleet):
        value = getattr(fleet, field.name)
        other = np.where(np.isfinite(value), value + 1e-6, 1.0)
        others.append(tree_key(dataclasses.replace(fleet, **{field.name: other}), POSES, GOAL))
    assert len({key, *others}) == 1 + len(others)


def test_a_file_gives_back_the_tree(tree, tmp_path, monkeypatch):
    file = tmp_path / "tree.npz"
    first = stored_tree(tree.fleet, POSES, GOAL, file)
    assert same(first, tree)
    refuse_to_build(monkeypatch)
    again = stored_tree(tree.fleet, POSES, GOAL, file)
    assert same(again, tree)
    assert query(again, STARTS[0])[0].cost == query(tree, STARTS[0])[0].cost
    assert [p.name for p in tmp_path.iterdir()] == ["tree.npz"]


def test_a_file_of_another_scene_or_version_is_refused(tmp_path, monkeypatch):
    file = tmp_path / "tree.npz"
    stored_tree(fleet_of(2), POSES, GOAL, file)
    with pytest.raises(InputError, match=r"tree\.npz.*another scene"):
        stored_tree(fleet_of(2), POSES, GOAL + 0.01, file)
    monkeypatch.setattr("flatpush.planning.graph.tree.VERSION", 99)
    with pytest.raises(InputError, match="version"):
        stored_tree(fleet_of(2), POSES, GOAL, file)


def damages(file: Path):
    """The file cut short, with a byte flipped, empty, another kind of file, another kind of archive."""
    whole = file.read_bytes()
    yield whole[: len(whole) // 2]
    for at in (len(whole) // 3, len(whole) // 2):
        yield whole[:at] + bytes([whole[at] ^ 0xFF]) + whole[at + 1 :]
    yield b""
    yield b"no tree"
    yield b"\x93NUMPY" + whole[6:200]


def test_damaged_files_are_refused(tmp_path):
    file = tmp_path / "tree.npz"
    stored_tree(fleet_of(2), POSES, GOAL, file)
    for content in list(damages(file)):
        file.write_bytes(content)
        with pytest.raises(InputError, match=r"tree\.npz"):
            stored_tree(fleet_of(2), POSES, GOAL, file)
        assert file.read_bytes() == content
    np.save(tmp_path / "array.npy", np.zeros(3))
    np.savez(tmp_path / "pickled.npz", format=np.array([{}], dtype=object))
    np.savez(tmp_path / "other.npz", x=np.zeros(3))
    for name in ("array.npy", "pickled.npz", "other.npz"):
        with pytest.raises(InputError, match=name):
            stored_tree(fleet_of(2), POSES, GOAL, tmp_path / name)
    with pytest.raises(InputError):
        stored_tree(fleet_of(2), POSES, GOAL, tmp_path)  # a folder
    with pytest.raises(InputError, match="nothing was written"):
        stored_tree(fleet_of(2), POSES, GOAL, tmp_path / "nowhere" / "tree.npz")


def test_arrays_that_are_no_tree_are_refused(tmp_path):
    """The right key does not make the content right: pointers out of range, circles, nan."""
    tree = build_tree(fleet_of(2), POSES, GOAL)
    circle = {"follow": np.zeros_like(tree.follow), "take": np.zeros_like(tree.take)}
    wrong = [
        {"follow": tree.follow + np.int32(len(POSES))},
        {"take": tree.take + np.int16(2)},
        {"costs": tree.costs * np.nan},
        {"costs": tree.costs[:, :-1]},
        {"follow": tree.follow.astype(float)},
        circle,
    ]
    for change in wrong:
        tree_file.save_arrays({**tree.arrays, **change}, tmp_path / "tree.npz", tree.key)
        with pytest.raises(InputError, match=r"tree\.npz"):
            stored_tree(tree.fleet, POSES, GOAL, tmp_path / "tree.npz")


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("FLATPUSH_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "trees-1"


def refuse_to_build(monkeypatch):
    def refuse(*_):
        raise AssertionError("built again")

    monkeypatch.setattr("flatpush.planning.graph.store.build_tree", refuse)


def test_the_cache_builds_once(cache, monkeypatch):
    first = stored_tree(fleet_of(2), POSES, GOAL)
    assert [f.name for f in cache.iterdir()] == [f"{first.key}.npz"]
    other = stored_tree(fleet_of(2), POSES, GOAL + 0.01)
    assert len(list(cache.iterdir())) == 2
    refuse_to_build(monkeypatch)
    assert same(stored_tree(fleet_of(2), POSES, GOAL), first)
    assert same(stored_tree(fleet_of(2), POSES, GOAL + 0.01), other)


def test_a_damaged_cache_is_built_again_without_a_word(cache, capsys):
    tree = stored_tree(fleet_of(2), POSES, GOAL)
    file = cache / f"{tree.key}.npz"
    whole = file.read_bytes()
    for content in list(damages(file)):
        file.write_bytes(content)
        assert same(stored_tree(fleet_of(2), POSES, GOAL), tree)
        assert file.read_bytes() == whole
    tree_file.save_arrays({**tree.arrays, "follow": tree.follow * 0}, file, tree.key)  # circles
    assert same(stored_tree(fleet_of(2), POSES, GOAL), tree)
    assert capsys.readouterr() == ("", "")


def test_a_cache_that_cannot_be_written_costs_time_only(cache):
    cache.parent.write_text("in the way")
    assert len(stored_tree(fleet_of(2), POSES, GOAL).poses) == len(POSES)


def test_the_cache_forgets_what_was_not_used_for_longest(cache, monkeypatch):
    keys = [stored_tree(fleet_of(2), POSES, GOAL + d).key for d in (0.0, 0.1, 0.2)]
    for age, key in enumerate(keys):
        os.utime(cache / f"{key}.npz", (1000 + age, 1000 + age))
    stored_tree(fleet_of(2), POSES, GOAL)  # used again
    size = (cache / f"{keys[0]}.npz").stat().st_size
    monkeypatch.setattr(tree_file, "LIMIT", 2.5 * size)
    new = stored_tree(fleet_of(2), POSES, GOAL + 0.3).key
    assert {f.stem for f in cache.iterdir()} == {keys[0], new}


def test_the_cache_folder_follows_the_platform(monkeypatch):
    monkeypatch.delenv("FLATPUSH_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert tree_file.cache_folder() == Path("/somewhere/flatpush")
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr("sys.platform", "linux")
    assert tree_file.cache_folder() == Path.home() / ".cache" / "flatpush"
    monkeypatch.setenv("FLATPUSH_CACHE", "/mine")
    assert tree_file.cache_folder() == Path("/mine")


WRITE_OFTEN = """
import os, sys, pathlib, numpy as np
from flatpush.documents import tree_file
folder = pathlib.Path(os.environ["FLATPUSH_CACHE"])
arrays = {"x": np.arange(20000.0)}
for round in range(60):
    if round % 4 == 0:
        for file in folder.glob("*/key.npz"):
            file.unlink(missing_ok=True)
    found = tree_file.cached_arrays("key", lambda: arrays)
    assert np.array_equal(found["x"], arrays["x"])
"""


def test_two_processes_may_use_the_cache_at_once(tmp_path):
    environment = {**os.environ, "FLATPUSH_CACHE": str(tmp_path)}
    command = [sys.executable, "-W", "error", "-c", WRITE_OFTEN]
    both = [subprocess.Popen(command, env=environment, stderr=subprocess.PIPE) for _ in range(2)]
    told = [process.communicate(timeout=60)[1].decode() for process in both]
    assert told == ["", ""]
    assert [process.returncode for process in both] == [0, 0]
    assert [f.name for f in (tmp_path / "trees-1").iterdir()] == ["key.npz"]
