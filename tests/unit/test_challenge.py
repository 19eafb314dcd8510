"""The challenge: its scenes are those of its command, its judge is right about strokes whose outcome is known."""

import json
import sys
from collections import Counter
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from tests.extras import extra

import flatpush as fp
from flatpush.geometry import relative, transform

FOLDER = Path(__file__).parents[2] / "benchmarks" / "challenge"
MODULES = ("scenes", "judge", "entries", "run")
WAY = 0.05  # [m]


@pytest.fixture(scope="module")
def challenge():
    """Its modules by name; they import each other as a command's neighbours do."""
    sys.path.insert(0, str(FOLDER))
    yield {name: import_module(name) for name in MODULES}
    sys.path.remove(str(FOLDER))
    for name in MODULES:
        del sys.modules[name]


def square(goal=(0.0, WAY, 0.0), friction=0.3, **fields) -> fp.Scene:
    """A square of 40 mm on four feet, to be pushed by its lower side."""
    feet = fp.Support.points([(-0.01, -0.01), (0.01, -0.01), (0.01, 0.01), (-0.01, 0.01)])
    side = [(-0.02, -0.02), (0.02, -0.02), (0.02, 0.02), (-0.02, 0.02)]
    planning = fp.Planning(goal_tolerance=(2e-3, 2e-3, np.deg2rad(2)))
    return fp.Scene(fp.Object(side, feet, friction), (0.0, 0.0, 0.0), goal=goal, planning=planning, **fields)


def upwards(length=WAY, x=0.0, y=-0.0235):
    """A finger 1 mm below the square that goes up by 1 mm and the length."""
    return np.array([[x, y, 0.0], [x, y + 0.001 + length, 0.0]])


def verdict(challenge, scene, strokes):
    judge = challenge["judge"]
    return judge.judged(scene, challenge["entries"].open_loop(lambda _: strokes), judge.PlantPhysics)


def test_the_scenes_are_those_of_their_seed_25_of_each_kind(challenge):
    lines = challenge["scenes"].FILE.read_text(encoding="utf-8").splitlines()
    assert lines[::40] == [challenge["scenes"].line(k) for k in range(0, len(lines), 40)]
    documents = [json.loads(line) for line in lines]
    kinds = Counter(
        (d["pusher"]["fingers"], d["object"]["friction"] > 0, "workspace" in d) for d in documents
    )
    assert set(kinds.values()) == {25}
    assert len(kinds) == 8


def test_a_stroke_to_the_goal_is_solved_and_costs_its_way(challenge):
    found = verdict(challenge, square(), [upwards()])
    assert found.reason == ""
    assert found.strokes == 1
    assert found.cost == pytest.approx(WAY + 0.001)
    half = [upwards(0.5 * WAY), upwards(0.5 * WAY, y=-0.0235 + 0.5 * WAY)]
    twice = verdict(challenge, square(), half)
    assert (twice.reason, twice.strokes) == ("", 2)
    assert twice.cost == pytest.approx(WAY + 0.002 + 0.03)


@pytest.mark.parametrize(
    ("strokes", "reason"),
    [
        ([], "no answer"),
        ([upwards(0.5 * WAY)], "missed"),
        ([upwards(y=-0.021)], "landed in the object"),
        ([[[0.0, 0.0]]], "a stroke is finite numbers, shape (n, 3), two poses or more"),
        ([upwards() * np.nan], "a stroke is finite numbers, shape (n, 3), two poses or more"),
        ([np.array([[0.0, -0.1, 0.0], [0.0, -7.0, 0.0]])], "too long a way"),
    ],
)
def test_what_is_no_success_says_why(challenge, strokes, reason):
    assert verdict(challenge, square(), strokes).reason == reason


@pytest.mark.parametrize(("place", "what"), [((0.018, 0.05), "object"), ((0.1, -0.04), "finger")])
def test_an_obstacle_ends_it_also_for_the_finger_alone(challenge, place, what):
    corner = np.array([(0.0, 0.0), (0.01, 0.0), (0.01, 0.01), (0.0, 0.01)]) + place
    scene = square(workspace=fp.Workspace((-0.2, -0.2, 0.2, 0.2), (corner,)))
    beside = np.array([[0.09, -0.035, 0.0], [0.13, -0.035, 0.0]])
    assert verdict(challenge, scene, [beside, upwards()]).reason == f"{what} hit something"


def test_a_hollow_outline_is_cut_into_boxes(challenge):
    tee = [(0, 0), (0.06, 0), (0.06, 0.02), (0.04, 0.02), (0.04, 0.05), (0.02, 0.05), (0.02, 0.02), (0, 0.02)]
    boxes = challenge["judge"].boxes(fp.Object(tee))
    expected = [(0, 0, 0.02, 0.02), (0.02, 0, 0.04, 0.05), (0.04, 0, 0.06, 0.02)]
    assert np.allclose(boxes, expected)
    assert challenge["judge"].boxes(square().object) == []


def test_of_two_fingers_one_leads(challenge):
    scene = square(pusher=fp.Pusher(fingers=2, spacing=0.018), friction=0.0)
    way = upwards()
    hands = challenge["entries"].behind(scene, way)
    tips = np.array([transform(hand, challenge["judge"].fingertips(scene)) for hand in hands])
    assert np.allclose(tips[:, 0], way[:, :2])
    assert np.allclose(tips[:, 1], way[:, :2] - [0.0, 0.018])


def test_ompl_drives_the_car_of_a_push_to_the_goal(challenge):
    pytest.importorskip("ompl.base", reason="OMPL is not installed")
    scene = challenge["run"].scenes(1, 3)[0]
    (hands,) = challenge["entries"].ompl_strokes(scene)
    tips = transform(relative(scene.goal_pose, hands[-1]), challenge["judge"].fingertips(scene))
    near = [scene.object.outline.nearest(tip).distance for tip in tips]
    assert near == pytest.approx([scene.pusher.tip_radius] * 2, abs=1e-6)
    steps = np.linalg.norm(np.diff(hands[:, :2], axis=0), axis=1)
    assert np.max(steps) < 0.004


def test_results_are_told_again(challenge):
    judge, run = challenge["judge"], challenge["run"]
    verdicts = [judge.Verdict("", 0.1, 1, 0.5, 0.0, 0.0), judge.Verdict("missed", 0.2, 2, 1.5, 0.01, 0.0)]
    kept = run.kept("mine", "plant", 0, verdicts)
    assert json.loads(kept)["verdicts"][1]["reason"] == "missed"
    rows = list(run.told(kept))
    assert rows[-1] == "| all |  |  | 1 of 2 | 100 mm | 1.00, 1.50 | missed: 1 |"
    assert "**mine**, judge plant" in rows[0]


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_both_judges_see_the_same_stroke(challenge, friction):
    """A push beside the centre, which slides without friction; MuJoCo at the speed at which it judges."""
    pytest.importorskip("mujoco", reason=extra("sim"))
    scene, judge = square(friction=friction), challenge["judge"]
    hands = judge.finer(scene, upwards(0.03, x=0.008))
    ends = [judge.PHYSICS[name](scene).stroke(scene.start_pose, hands)[-1] for name in ("plant", "mujoco")]
    assert abs(ends[0][2]) > 0.1
    assert np.allclose(ends[0], ends[1], atol=[3e-4, 3e-4, 5e-3])
