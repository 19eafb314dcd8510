"""Demonstrations: each is replayed, the data set is read by the layout's own rules, and breaks leave it readable."""

import errno
import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from tests.command_line import flatpush
from tests.extras import extra
from tests.waiting import PATIENCE, started, until

import flatpush as fp
from flatpush.documents import load_motions, parse_scene, scene_document
from flatpush.errors import InputError

pytest.importorskip("gymnasium", reason=extra("demonstrations"))
parquet = pytest.importorskip("pyarrow.parquet", reason=extra("demonstrations"))

from tests.quick_episodes import quick  # noqa: E402

from flatpush.gym import Eyes, PushTask, demonstrations, lerobot  # noqa: E402  # after what they need
from flatpush.gym.demonstrations import Block, Episode  # noqa: E402
from flatpush.gym.push import PushEnv  # noqa: E402

BRICK = [(-0.03, -0.02), (0.03, -0.02), (0.03, 0.02), (-0.03, 0.02)]
SCENE = fp.Scene(fp.Object(BRICK, friction=0.0), (0.07, 0.03, 0.9))


def made_up(lengths, rng) -> Block:
    """A block of episodes of random numbers."""
    episodes = tuple(
        Episode(int(rng.integers(1000)), 0, rng.normal(size=(n, 10)), rng.normal(size=(n, 2)), rng.normal(size=n), -1,
                np.zeros(3), rng.normal(size=10))
        for n in lengths
    )  # fmt: skip
    return Block(SCENE, episodes, len(episodes))


def read(folder):
    """Information, frames and episodes, as a reader of the layout finds them: by the paths of info.json alone."""
    info = json.loads((folder / "meta" / "info.json").read_text())
    frames, episodes, seen = {}, [], set()
    listed = sorted((folder / "meta" / "episodes").rglob("*.parquet"))
    for row in (row for path in listed for row in parquet.read_table(path).to_pylist()):
        if row["episode_index"] >= info["total_episodes"]:
            continue
        place = {key: row[f"data/{key}"] for key in ("chunk_index", "file_index")}
        path = folder / info["data_path"].format(**place)
        if path not in seen:
            seen.add(path)
            frames |= {frame["index"]: frame for frame in parquet.read_table(path).to_pylist()}
        episodes.append(row)
    return info, frames, sorted(episodes, key=lambda row: row["episode_index"])


def check(folder, broken=False):
    """The rules of the layout: indices run on, times follow the rate, episodes and statistics are of their frames.

    Broken off before its last file, info.json, a block has its part in stats.json already: then only sums are compared.
    """
    info, frames, episodes = read(folder)
    assert info["codebase_version"] == "v3.0"
    assert [e["episode_index"] for e in episodes] == list(range(info["total_episodes"]))
    start = 0
    for row in episodes:
        assert row["dataset_from_index"] == start
        start = row["dataset_to_index"]
        own = [frames[k] for k in range(row["dataset_from_index"], start)]
        assert len(own) == row["length"]
        assert [f["frame_index"] for f in own] == list(range(row["length"]))
        assert {f["episode_index"] for f in own} == {row["episode_index"]}
        assert np.allclose([f["timestamp"] for f in own], np.arange(len(own)) / info["fps"], atol=1e-4)
        assert [f["next.done"] for f in own] == [False] * (len(own) - 1) + [True]
        states = np.array([f["observation.state"] for f in own])
        assert np.allclose(row["stats/observation.state/mean"], states.mean(axis=0), atol=1e-5)
        for name, told in info["features"].items():
            value = own[0][name]
            assert len(value) == told["shape"][0] if isinstance(value, list) else told["shape"] == [1]
    assert start == info["total_frames"]
    whole = np.array([frames[k]["action"] for k in range(start)])
    sums = [whole.min(0), whole.max(0), whole.sum(0), (whole**2).sum(0)]
    assert np.allclose(info["flatpush"]["sums"]["action"], sums, rtol=1e-5, atol=1e-5)
    told = json.loads((folder / "meta" / "stats.json").read_text())
    stats = told["action"]
    for name, value in (
        ()
        if broken
        else (
            ("min", whole.min(0)),
            ("max", whole.max(0)),
            ("mean", whole.mean(0)),
            ("std", whole.std(0)),
        )
    ):
        assert np.allclose(stats[name], value, atol=1e-5)
    assert broken or told["next.done"]["mean"] == pytest.approx([len(episodes) / start])
    tasks = parquet.read_table(folder / "meta" / "tasks.parquet").to_pylist()
    assert [t["task_index"] for t in tasks] == [0]
    return info, frames, episodes


def test_blocks_become_a_data_set_and_it_goes_on(tmp_path):
    rng = np.random.default_rng(0)
    first = lerobot.LeRobotFolder(tmp_path / "set", 5)
    first.add(made_up([3, 7, 4], rng), 10)
    first.add(made_up([], rng), 10)
    later = lerobot.LeRobotFolder(tmp_path / "set", 5)
    assert (later.episodes, later.frames, later.blocks) == (3, 14, 2)
    block = made_up([5, 6, 2], rng)
    later.add(block, 2)
    info, frames, episodes = check(tmp_path / "set")
    assert info["total_episodes"] == 5
    assert info["total_frames"] == 25
    own = [frames[k]["observation.state"] for k in range(14, 19)]
    assert np.allclose(own, block.episodes[0].states, atol=1e-6)
    assert episodes[3]["flatpush/seed"] == block.episodes[0].seed


@pytest.mark.parametrize("breaks_at", [0, 1, 2, 3, 4, 5])
def test_a_full_disk_leaves_what_is_complete(tmp_path, monkeypatch, breaks_at):
    """Whichever file of the second block cannot be written, the first is read as before, and a new run goes on."""
    rng = np.random.default_rng(1)
    folder = lerobot.LeRobotFolder(tmp_path / "set", 0)
    folder.add(made_up([4, 5], rng), 10)
    whole, count = lerobot.write_atomically, iter(range(100))

    def full(path, data):
        if next(count) == breaks_at:
            raise InputError("no space left on device", source=str(path))
        whole(path, data)

    monkeypatch.setattr(lerobot, "write_atomically", full)
    with pytest.raises(InputError, match="no space"):
        folder.add(made_up([6], rng), 10)
    monkeypatch.setattr(lerobot, "write_atomically", whole)
    info, frames, episodes = read(tmp_path / "set")
    assert info["total_episodes"] == 2
    assert [e["length"] for e in episodes] == [4, 5]
    assert all(k in frames for k in range(9))
    again = lerobot.LeRobotFolder(tmp_path / "set", 0)
    again.add(made_up([2, 3], rng), 10)
    assert check(tmp_path / "set")[0]["total_episodes"] == 4


def test_the_same_episodes_as_arrays_and_as_bags(tmp_path):
    """Read by NumPy and by our reader of bags: 12 decisions in which object and finger go 1 mm each."""
    pytest.importorskip("mcap", reason=extra("export"))
    pytest.importorskip("rosbags", reason=extra("export"))
    n, states = 12, np.zeros((13, 10))
    states[:, 0] = states[:, 4] = 0.001 * np.arange(13)
    states[:, 2], states[:, 3], states[:, 5] = np.sin(0.3), np.cos(0.3), -0.02
    actions = np.tile(np.array([0.5, 0.0], np.float32), (n, 1))
    episode = Episode(7, 0, states[:n], actions, np.arange(n) / n, 4, np.zeros(3), states[n])
    folder = lerobot.LeRobotFolder(tmp_path / "set", 0, ("mcap", "gymnasium"))
    folder.add(Block(SCENE, (episode,), 1), 5)
    folder.add(Block(SCENE, (episode,), 1), 5)
    made = sorted(str(p.relative_to(tmp_path / "set")) for p in (tmp_path / "set").glob("[gm][yc]*/**/*.*"))
    names = [f"{form}/000/episode-00000{k}.{end}" for form, end in (("gymnasium", "npz"), ("mcap", "mcap"))
             for k in (0, 1)]  # fmt: skip
    assert made == names
    with np.load(tmp_path / "set" / names[1]) as archive:
        arrays = dict(archive)
    assert np.allclose(arrays["observations"], states, atol=1e-7)
    assert np.array_equal(arrays["actions"], actions)
    assert arrays["terminations"].tolist() == [False] * (n - 1) + [True]
    assert int(arrays["seed"]) == 7
    (motion,) = load_motions(tmp_path / "set" / names[3]).motions
    assert np.allclose(motion.times, 0.1 * np.arange(n))
    assert np.allclose(motion.poses, np.column_stack([states[:n, :2], np.full(n, 0.3)]))
    assert np.allclose(motion.tips, states[:n, 4:6])
    with pytest.raises(InputError, match="begun with gymnasium, mcap"):
        lerobot.LeRobotFolder(tmp_path / "set", 0)


# Made-up episodes, quickly, by the command itself in a process of its own.
QUICK = """
import signal
import sys
sys.path.insert(0, {tests!r})
signal.signal(signal.SIGINT, signal.default_int_handler)
import quick_episodes
from flatpush.gym import demonstrations
demonstrations.demonstrated = quick_episodes.{blocks}
from flatpush.cli import main
main()
"""


def demonstrating(folder, blocks):
    """The command with a function of tests/quick_episodes.py that makes its blocks."""
    scene = folder / "scene.json"
    scene.write_text(json.dumps(scene_document(SCENE)))
    code = QUICK.format(tests=str(Path(__file__).parents[1]), blocks=blocks)
    return [sys.executable, "-c", code, "demonstrate", str(scene), "-o", str(folder / "set")]


@pytest.mark.slow
@pytest.mark.parametrize("how", ["SIGINT", "SIGKILL"])
def test_what_was_broken_off_is_readable_and_goes_on(tmp_path, how):
    """Broken off between or in its writes, it ends as one that was not: the same frames in the same order."""
    info = tmp_path / "set" / "meta" / "info.json"
    words = [*demonstrating(tmp_path, "quick"), "--workers", "1", "--seed", "3", "-n"]
    with started([*words, "100000"], stderr=subprocess.PIPE) as running:
        until(lambda: info.exists() and json.loads(info.read_text())["total_episodes"] >= 4)
        running.send_signal(getattr(signal, how))
        _, said = running.communicate()
    assert running.returncode == (130 if how == "SIGINT" else -signal.SIGKILL), said
    count = check(info.parents[1], broken=True)[0]["total_episodes"]
    folder, number = lerobot.LeRobotFolder(tmp_path / "whole", 3), 0
    while folder.episodes < count + 3:
        folder.add(quick(SCENE, 3, number), count + 3 - folder.episodes)
        number += 1
    ended = subprocess.run([*words, str(count + 3)], capture_output=True, text=True, timeout=PATIENCE)
    assert ended.returncode == 0, ended.stderr
    ours, whole = (check(tmp_path / name) for name in ("set", "whole"))
    assert ours[1] == whole[1]
    assert ours[0]["total_frames"] == whole[0]["total_frames"]


@pytest.mark.slow
def test_ctrl_c_does_not_wait_for_blocks_that_are_being_made(tmp_path):
    """They take minutes, and only the command itself is told; its workers end with it."""
    info = tmp_path / "set" / "meta" / "info.json"
    with started(
        [*demonstrating(tmp_path, "stuck_at_last"), "--workers", "2"], stderr=subprocess.PIPE
    ) as one:
        until(lambda: info.exists() and json.loads(info.read_text())["total_episodes"] == 4)
        one.send_signal(signal.SIGINT)
        _, said = one.communicate(timeout=PATIENCE)
    assert one.returncode == 130, said
    assert "Traceback" not in said
    assert check(tmp_path / "set")[0]["total_episodes"] == 4


def test_a_full_disk_is_named(tmp_path, monkeypatch):
    """After the second block; the status is that of bad input, and what was written is complete."""
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps(scene_document(SCENE)))
    monkeypatch.setattr(demonstrations, "demonstrated", quick)
    sync, left = os.fsync, iter(range(100))

    def full(file):
        if next(left) == 8:  # of six files in a block
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        sync(file)

    monkeypatch.setattr(os, "fsync", full)
    ended = flatpush("demonstrate", scene, "-o", tmp_path / "set", "--workers", 1, "-n", 9)
    assert ended.returncode == 2
    assert "no space left on device" in ended.stderr
    assert f"{tmp_path}/set/meta" in ended.stderr
    assert check(tmp_path / "set")[0]["total_episodes"] == 2
    assert not list((tmp_path / "set").rglob("*.part"))


def test_a_cluster_is_given_blocks_by_number_and_they_come_in_order(monkeypatch):
    monkeypatch.setattr(demonstrations, "demonstrated", quick)
    given = []

    def spread(function, jobs):
        given.append([number for _, _, number in jobs])
        return [function(job) for job in jobs]

    made = demonstrations.blocks([SCENE, SCENE], 5, 3, spread=spread)
    found = list(islice(made, demonstrations.AT_ONCE + 1))
    assert given == [list(range(3, 11)), list(range(11, 19))]
    for number, block in enumerate(found, start=3):
        assert np.array_equal(block.episodes[0].states, quick(SCENE, 5, number).episodes[0].states)


def test_what_is_no_data_set_of_ours_is_left_alone(tmp_path):
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(InputError, match="something else"):
        lerobot.LeRobotFolder(tmp_path, 0)
    folder = lerobot.LeRobotFolder(tmp_path / "set", 0)
    folder.add(made_up([2], np.random.default_rng(0)), 1)
    with pytest.raises(InputError, match="another seed"):
        lerobot.LeRobotFolder(tmp_path / "set", 1)
    (tmp_path / "set" / "meta" / "info.json").write_text("{}")
    with pytest.raises(InputError, match="no data set that flatpush wrote"):
        lerobot.LeRobotFolder(tmp_path / "set", 0)
    with pytest.raises(InputError, match="one finger"):
        demonstrations.check_scenes([replace(SCENE, pusher=fp.Pusher(fingers=2, spacing=0.018))])


@pytest.mark.parametrize(
    "changed",
    [
        {"total_episodes": "5"},
        {"total_frames": -1},
        {"flatpush": {"seed": 0, "blocks": 1, "files": 1, "sums": []}},
    ],
)
def test_counts_that_are_none_are_refused(tmp_path, changed):
    """They ended with a traceback, or after the first block had been made."""
    lerobot.LeRobotFolder(tmp_path / "set", 0).add(made_up([3], np.random.default_rng(1)), 1)
    info = tmp_path / "set" / "meta" / "info.json"
    info.write_text(json.dumps(json.loads(info.read_text()) | changed))
    with pytest.raises(InputError, match="no data set that flatpush wrote"):
        lerobot.LeRobotFolder(tmp_path / "set", 0)


def test_a_folder_that_cannot_be_made_is_told_before_the_work(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        lerobot.LeRobotFolder(tmp_path / "file" / "set", 0)


def test_a_replay_notices_another_action_and_another_end():
    env = PushEnv(PushTask(SCENE, random=False))
    options = {"seed": 3}
    states, actions = [env.reset(**options)[0]], [np.array([0.5, 0.5], np.float32)] * 3
    for action in actions:
        state, reward, *_ = env.step(action)
        states.append(state)
    whole = Episode(3, 0, np.array(states[:3]), np.array(actions), np.full(3, reward), -1, np.zeros(3), state)
    assert demonstrations.replays(env.task, [whole]) == [False]  # it leads nowhere
    other = replace(whole, actions=whole.actions * np.float32(0.9))
    assert demonstrations.replays(env.task, [other, whole]) == [False, False]


@pytest.fixture(scope="module")
def knocked(tmp_path_factory):
    """A data set of a few episodes in which the object is knocked aside."""
    folder = tmp_path_factory.mktemp("knocked") / "set"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demonstrations, "BLOCK", 4)
        patch.setattr(demonstrations, "DISTURBED", 1.0)
        block = demonstrations.demonstrated(SCENE, 2, 0)
    assert len(block.episodes) >= 3
    lerobot.LeRobotFolder(folder, 2).add(block, 10)
    return folder


@pytest.mark.slow
def test_demonstrations_reach_their_goals_also_after_a_knock(knocked):
    """Read back from the data set alone: scene, seed and knock of each, and its actions lead to the goal once more."""
    _, frames, episodes = check(knocked)
    assert any(e["flatpush/disturbed"] >= 0 for e in episodes)
    told = json.loads((knocked / "meta" / "flatpush" / "scene-00000.json").read_text())
    task = PushTask(parse_scene(told), noise=fp.Noise(0.0, 0.0, 0.1), eyes=Eyes(2e-4, 3e-3))
    env = PushEnv(task)
    for row in episodes:
        env.reset(seed=row["flatpush/seed"])
        for k, index in enumerate(range(row["dataset_from_index"], row["dataset_to_index"])):
            if k == row["flatpush/disturbed"]:
                env.displace(np.array(row["flatpush/displacement"]))
            *_, ended, _, info = env.step(np.array(frames[index]["action"], np.float32))
        assert ended
        assert info["is_success"]


@pytest.mark.slow
def test_a_judge_of_data_sets_finds_no_failure(knocked):
    """lerobot-doctor warns of what the set has not: pictures, and no two equal actions in a row."""
    pytest.importorskip("lerobot_doctor", reason=extra("test-all"))
    words = [sys.executable, "-m", "lerobot_doctor.cli", "check", "--json", str(knocked)]
    told = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE)
    found = {check["name"]: check["severity"] for check in json.loads(told.stdout)["checks"]}
    assert len(found) >= 11
    assert {name for name, severity in found.items() if severity != "PASS"} <= {
        "Action Quality", "Training Readiness", "Per-Episode Summary"
    }  # fmt: skip
    assert "FAIL" not in found.values()
