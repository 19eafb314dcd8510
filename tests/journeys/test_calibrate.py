"""From logs of one's own to a calibration, and from that to predictions, on the command line."""

import json
import math

import numpy as np
import pytest
from tests.command_line import flatpush

from flatpush.cli.app import app
from flatpush.cli.recordings import read_recordings
from flatpush.documents import load_robot_log
from flatpush.documents.calibration_file import CalibrationFile, load_calibration, save_calibration
from flatpush.documents.robot_log import RAW
from flatpush.errors import InputError
from flatpush.geometry import compose, inverse
from flatpush.problem import Object
from flatpush.simulation.calibration import Parameters, Setup
from flatpush.simulation.plant import Plant

CORNERS = np.array([[25, -17.5], [25, 17.5], [-25, 17.5], [-25, -17.5]]) / 1000
FINGERS, TIP = np.array([[0.0, 0.009], [0.0, -0.009]]), 0.0025
# What the robot's hand is truly told wrong: camera map, tag, inset.
TRUE = Parameters(
    np.array([0.004, -0.003, 0.005, -0.01, 0.0012, -0.0016]),
    {"block": np.array([0.001, -0.0006, 0.012])},
    2e-4,
)
SCENE = """flatpush: scene/1
units: {length: mm, angle: deg}
object: {name: block, outline: [[25, -17.5], [25, 17.5], [-25, 17.5], [-25, -17.5]], friction: 1}
pusher: {fingers: 2, spacing: 18, tip_radius: 2.5}
start: [0, 0, 0]
goal: [100, 0, 0]
"""
# Starts of the object, and of each push the side it is pushed at and how the hand turns over 60 mm.
STARTS = {"a": (0.0, 0.0, 0.3), "b": (0.08, -0.05, 2.0), "c": (-0.06, 0.06, -1.2)}
SIDES = {
    "a": (("west", 0.4), ("south", -0.3)),
    "b": (("south", 0.3), ("west", -0.4)),
    "c": (("west", 0.0), ("south", 0.4)),
}
SIDE = {"west": (-0.025 - TIP, 0.0, 0.0), "south": (0.0, -0.0175 - TIP, np.pi / 2)}


def logs(folder, lag=0.1):
    """Two runs from each start, in the layout of run --log: the object as physics moves it, the camera as it is."""
    thing = Object(CORNERS, friction=1.0)
    plant = Plant(thing, FINGERS, TIP - TRUE.inset)
    pivot = np.zeros(2)
    registration = TRUE.registration(Setup({"block": thing}, FINGERS, TIP, pivot), "block")
    matrix, shift = registration.camera.matrix, registration.camera.shift
    rng, files = np.random.default_rng(2), []
    rows = [
        "object,start_id,run_id,t,obj_x_mm,obj_y_mm,obj_theta_rad,pusher_x_mm,pusher_y_mm,pusher_theta_rad,action_id"
    ]
    for start, pose in STARTS.items():
        for run in range(2):
            q, t, table = np.array(pose) + rng.normal(size=3) * [0.002, 0.002, 0.03], 0.0, []
            for k, (side, turn) in enumerate(SIDES[start]):
                place = np.array(SIDE[side]) + rng.normal(size=3) * [4e-4, 4e-4, 0.02]
                s = np.minimum(np.arange(110) / 89, 1.0)  # and rests at the end
                way = np.column_stack(
                    [0.06 * np.sinc(turn * s / 2 / np.pi) * s, 0.03 * turn * s**2, turn * s]
                )
                hand = compose(compose(q, place), way - [0.001, 0, 0])
                poses = plant.follow(q, hand).object
                table += [(t + j / 30, poses[j], hand[j], k + 1) for j in range(110)]
                q, t = poses[-1], t + 5.0
            times = np.array([row[0] for row in table])
            x = np.array([row[1] for row in table])
            seen = np.column_stack([np.interp(times - lag, times, c) for c in x.T])
            for (at, _, hand, action), late in zip(table, seen, strict=True):
                frame = compose(late, inverse(TRUE.tags["block"]))
                xy = np.linalg.solve(matrix, frame[:2] - shift) + rng.normal(size=2) * 1e-4
                numbers = [at, *(1000 * xy), frame[2] - registration.camera.turn, *(1000 * hand[:2]), hand[2]]
                rows.append(f"block,{start},{run}," + ",".join(f"{v:.6f}" for v in numbers) + f",{action}")
    files.append(folder / "runs.csv")
    files[0].write_text("\n".join(rows) + "\n")
    (folder / "scene.yaml").write_text(SCENE)
    return files


@pytest.mark.slow
def test_two_commands_from_logs_to_predictions(tmp_path):
    """Starts left out are predicted far better than without the calibration, and the lag is found."""
    (log,) = logs(tmp_path)
    scene, target = tmp_path / "scene.yaml", tmp_path / "calibration.json"
    ended = flatpush("calibrate", log, "--scene", scene, "-o", target, "--json")
    assert ended.returncode == 0, ended.stderr
    told = json.loads(ended.stdout)
    assert told["runs"] == 6
    assert told["starts"] == 3
    left = np.array(told["left_out"])
    assert left[:, 0].mean() < 4e-4
    assert np.rad2deg(left[:, 1].mean()) < 0.4
    kept = load_calibration(target)
    assert kept.judged[:2] == pytest.approx([left[:, 0].mean(), left[:, 0].max()])
    assert kept.lag == pytest.approx(0.1, abs=0.02)
    before = json.loads(flatpush("replay", log, "--scene", scene, "--json").stdout)
    table, figure = tmp_path / "runs-out.csv", tmp_path / "runs.svg"
    with_it = ("replay", log, "--scene", scene, "--calibration", target)
    after = json.loads(flatpush(*with_it, "-o", table, "--figure", figure, "--json").stdout)
    uncorrected, corrected = (np.mean([one["final"][0] for one in runs]) for runs in (before, after))
    assert uncorrected > 8e-4
    assert corrected < 0.35 * uncorrected
    assert len(table.read_text().splitlines()) == 7
    assert figure.read_text().startswith("<svg")


def test_a_calibration_is_kept_as_it_is(tmp_path):
    kept = CalibrationFile(
        TRUE.camera,
        np.array([0.1, 0.2]),
        TRUE.tags,
        {"other": "block"},
        2e-4,
        0.9,
        0.16,
        np.array([1e-3, 2e-3, 0.1, 0.2]),
        7,
    )
    save_calibration(kept, tmp_path / "c.json")
    read = load_calibration(tmp_path / "c.json")
    assert read.camera == pytest.approx(kept.camera, abs=1e-15)
    assert read.pivot.tolist() == [0.1, 0.2]
    assert read.tags["block"].tolist() == TRUE.tags["block"].tolist()
    assert (read.carried, read.inset, read.friction, read.lag, read.runs) == (
        {"other": "block"},
        2e-4,
        0.9,
        0.16,
        7,
    )
    (tmp_path / "c.json").write_text('{"flatpush": "calibration/1"}')
    with pytest.raises(InputError, match="camera"):
        load_calibration(tmp_path / "c.json")


def renamed(log, target, without=()):
    """The same runs under names of one's own, in metres and degrees, the stamps in milliseconds."""
    head = "what,start,try,clock [ms],ox,oy,yaw,hx [mm],hy [mm],hyaw,push"
    rows = [line.split(",") for line in log.read_text().splitlines()[1:]]
    lines = []
    for row in rows:
        v = [float(cell) for cell in row[3:10]]
        new = [1e3 * v[0], v[1] / 1e3, v[2] / 1e3, math.degrees(v[3]), v[4], v[5], math.degrees(v[6])]
        lines.append([*row[:3], *map(repr, new), f"no. {row[10]}"])
    table = [head.split(","), *lines]
    kept = [k for k, name in enumerate(table[0]) if name not in without]
    target.write_text("".join(",".join(row[k] for k in kept) + "\n" for row in table))
    return target


OWN = "{object: what, run: try, t: clock, x: ox, y: oy, theta: yaw, px: hx, py: hy, ptheta: hyaw}"


@pytest.mark.slow
def test_names_of_columns_that_the_scene_gives_hold_for_calibrate_and_replay(tmp_path):
    (log,) = logs(tmp_path)
    own = renamed(log, tmp_path / "own.csv")
    scene = tmp_path / "scene.yaml"
    plain = json.loads(flatpush("replay", log, "--scene", scene, "--json").stdout)
    ended = flatpush("replay", own, "--scene", scene)
    assert ended.returncode == 2
    assert "Traceback" not in ended.stderr
    option = OWN[1:-1].replace(": ", "=")
    given = flatpush("replay", own, "--scene", scene, "--columns", option, "--units", "m,deg", "--json")
    scene.write_text(SCENE + f"logs: {{columns: {OWN}, length: m, angle: deg}}\n")
    for ended in (given, flatpush("replay", own, "--scene", scene, "--json")):
        assert ended.returncode == 0, ended.stderr
        for a, b in zip(plain, json.loads(ended.stdout), strict=True):
            assert (a["object"], a["start"], a["run"]) == (b["object"], b["start"], b["run"])
            assert b["final"] == pytest.approx(a["final"], abs=1e-6)
    recordings, _ = read_recordings([log, own], [scene], {})
    assert len(recordings) == 12
    scene.write_text(SCENE + f"logs: {{columns: {OWN.replace(', ptheta: hyaw', '')}, angle: deg}}\n")
    ended = flatpush("calibrate", own, "--scene", scene)
    assert ended.returncode == 2
    assert "column ptheta" in ended.stderr
    other = tmp_path / "other.yaml"
    other.write_text(SCENE.replace("name: block", "name: disc") + "logs: {columns: {x: ox}}\n")
    assert "differently" in flatpush("calibrate", own, "--scene", scene, "--scene", other).stderr


def test_an_object_that_was_not_seen_has_empty_cells_under_names_of_ones_own(tmp_path):
    path = tmp_path / "own.csv"
    path.write_text("t,ox,y,theta,px,py\n0,0,0,0,1,2\n1,,,,1,2\n2,nan,nan,nan,1,2\n3,4,5,90,1,2\n")
    file = load_robot_log(path, columns={"x": "ox[cm]"}, length="mm", angle="deg")
    (run,) = file.runs
    assert run.seen.tolist() == [True, False, False, True]
    assert not file.turned
    assert run.poses[3] == pytest.approx([0.04, 0.005, np.pi / 2])
    assert run.hands[3] == pytest.approx([0.001, 0.002, 0])
    path.write_text("t,ox,y,theta,px,py\n0,0,,0,1,2\n")
    with pytest.raises(InputError, match="line 2: y is not a number"):
        load_robot_log(path, columns={"x": "ox"})


def test_unusable_rows_are_left_out_and_listed_if_asked(tmp_path, capsys):
    scene, log = tmp_path / "scene.yaml", tmp_path / "cut.csv"
    scene.write_text(SCENE)
    rows = ["0,1,2,0.1,-30,2,0.1,1", "1,1,2,0.1", *(f"{t},1,{t},0.1,-60,3,0.1,1" for t in (2, 3, 4))]
    log.write_text("\n".join([",".join(RAW), *rows]) + "\n")
    with pytest.raises(InputError, match=r"line 3: it has 4 of 8 columns.*--skip-bad"):
        read_recordings([log], [scene], {})
    (one,), _ = read_recordings([log], [scene], {}, skip_bad=True)
    assert one.run.lines.tolist() == [2, 4, 5, 6]
    assert "cut.csv: line 3 left out: it has 4 of 8 columns" in capsys.readouterr().err
    assert app(["replay", str(log), "--scene", str(scene), "--skip-bad"], standalone_mode=False) == 0
    told = capsys.readouterr()
    assert "cut.csv: line 3 left out" in told.err
    assert "1 runs: " in told.out


def test_what_does_not_belong_together_is_refused(tmp_path):
    (log,) = logs(tmp_path)
    scene = tmp_path / "scene.yaml"
    text = log.read_text()
    other = tmp_path / "other.yaml"
    other.write_text(SCENE.replace("name: block", "name: disc").replace("spacing: 18", "spacing: 20"))
    assert "same pusher" in flatpush("calibrate", log, "--scene", scene, "--scene", other).stderr
    log.write_text(text.replace("block,c", "disc,c"))
    assert "no scene describes" in flatpush("replay", log, "--scene", scene).stderr
    log.write_text(text)
    other.write_text(SCENE.replace("[-25, 17.5], ", ""))  # half of the block, of its name
    ended = flatpush("replay", log, "--scene", other, "--json")
    assert (ended.returncode, ended.stderr.count("warning: ")) == (0, 1)
    assert "warning: runs of block end" in ended.stderr
    assert len(json.loads(ended.stdout)) == 6
    assert "warning" not in flatpush("replay", log, "--scene", scene).stderr
    assert "OBJECT=TAG" in flatpush("calibrate", log, "--scene", scene, "--tag", "block").stderr
    kept = CalibrationFile(np.zeros(6), np.zeros(2), {"cup": np.zeros(3)}, {}, 0.0, 0.5, 0.0, np.empty(0), 1)
    save_calibration(kept, tmp_path / "c.json")
    ended = flatpush("replay", log, "--scene", scene, "--calibration", tmp_path / "c.json")
    assert ended.returncode == 2
    assert "holds no tag of this object" in ended.stderr
    assert "Traceback" not in ended.stderr
