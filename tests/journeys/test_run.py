"""flatpush run, as a user runs it."""

import json
import signal
import subprocess
import sys
from contextlib import ExitStack

import pytest
from tests.waiting import started, until

import flatpush as fp
from flatpush.cli.app import app
from flatpush.documents import load_robot_log, mapping_of, parse_scene

SCENE = """
flatpush: scene/1
units: {length: mm, angle: deg}
object: {outline: [[-25, -17.5], [25, -17.5], [25, 17.5], [-25, 17.5]], friction: 0.4, name: block}
pusher: {fingers: 2, spacing: 18}
pushes: [{name: south, edge: 0, along: 0.5}]
start: [0, -60, 10]
goal: [0, 0, 0]
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    (folder / "scene.yaml").write_text(SCENE)
    plan = fp.plan(fp.load_scene(folder / "scene.yaml"))
    plan.save(folder / "plan.json")
    return folder


def call(*arguments):
    return app([str(a) for a in arguments], standalone_mode=False)


def test_a_plan_is_run_reported_logged_and_drawn(files, tmp_path, capsys):
    log, figure = tmp_path / "log.csv", tmp_path / "run.svg"
    asked = ("run", files / "plan.json", "--robot", "sim", "--scene", files / "scene.yaml")
    assert call(*asked, "--log", log, "--figure", figure) == 0
    told = capsys.readouterr()
    assert "limits: x -1000 to 1000 mm" in told.err
    assert "first approach: from" in told.err
    assert "done after" in told.out
    assert "off the goal by" in told.out
    assert load_robot_log(log).runs[0].object == "block"
    assert "the plan as it was run" in figure.read_text()
    assert call(*asked, "--speed", 0.5, "--controller", "path", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["outcome"] == "arrived"
    assert found["distance"] < 0.0005
    assert found["time"] > 2 * fp.load_plan(files / "plan.json").duration


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        (("--robot", "sim?speed=10"), r"a speed of \d+\.\d mm/s is above 10 mm/s"),
        (("--robot", "dry-run?heights=0,10"), "a height of 30.0 mm is outside of 0 to 10 mm"),
        (("--robot", "nobody://here"), "there is no such robot"),
        (("--robot", "sim?colour=1"), "no option 'colour'"),
        (("--robot", "sim?friction=-1"), "friction takes a number of at least 0"),
        (("--robot", "sim?noise=1,-1"), "noise takes 2 numbers separated by commas of at least 0"),
        (("--robot", "sim?seed=1.5"), "seed takes a whole number"),
        (("--robot", "egm://127.0.0.1:6510?connect=-1"), "connect takes a number of at least 0.001"),
        (("--robot", "franka://127.0.0.1:1338"), "a port cannot be chosen for franka"),
        (("--robot", "sim", "--speed", "2"), "at most 1 times its speed"),
        (("--robot", "sim", "--log", "log.txt"), "a log ends in .csv or .mcap"),
        (("--robot", "sim", "--controller", "pid"), "path, dfl, horizon"),
        (("--robot", "dry-run", "--controller", "path"), "does not see the object"),
        (("--robot", "sim", "--controller", "path", "--latency", "-1"), "--latency is a finite number"),
        (("--robot", "sim", "--film", "cell.gif"), "--film and --window show the physics cell"),
        (("--robot", "mujoco://tool", "--film", "cell.mp4"), "ends in .gif or .html"),
        (("--robot", "sim", "--base-frame", "1,2"), "--base-frame takes 4 numbers"),
    ],
)
def test_what_cannot_be_run_is_refused(files, options, rule, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(fp.FlatpushError, match=rule):
        call("run", files / "plan.json", *options)
    assert not list(tmp_path.iterdir())


def test_a_plan_that_fails_verification_or_is_for_another_scene_ends_with_4(files, tmp_path, capsys):
    text = (files / "plan.json").read_text()
    plan = json.loads(text)
    plan["cost"] *= 2
    (tmp_path / "wrong.json").write_text(json.dumps(plan))
    log = tmp_path / "log.csv"
    assert call("run", tmp_path / "wrong.json", "--robot", "sim", "--log", log) == 4
    assert "✗ cost" in capsys.readouterr().err
    (tmp_path / "other.yaml").write_text(SCENE.replace("friction: 0.4", "friction: 0.3"))
    other = ("--scene", tmp_path / "other.yaml")
    assert call("run", files / "plan.json", "--robot", "sim", "--log", log, *other) == 4
    assert "friction" in capsys.readouterr().err
    assert not log.exists()


def test_a_missing_extra_is_one_line(files, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with pytest.raises(fp.MissingExtra, match=r'pip install "flatpush\[export\]"'):
        call("run", files / "plan.json", "--robot", "sim", "--log", tmp_path / "log.mcap")


REAL = """
import sys, time
from flatpush.cli import main
from flatpush.execution import WallClock
from flatpush.execution import simulated
class Real(simulated.DryRun):
    real = True
    def __enter__(self):
        self.clock, self.begun = WallClock(), time.monotonic()
        return super().__enter__()
    def send(self, target):
        self._pose = target.pose
        return target
    def stop(self):
        print("stopped", file=sys.stderr, flush=True)
simulated.dry_run.__globals__["DryRun"] = Real
main()
"""


def start(files, *options):
    words = [sys.executable, "-c", REAL, "run", str(files / "plan.json"), "--robot", "dry-run", *options]
    return started(words, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE)


def test_nothing_real_moves_unless_somebody_says_so(files):
    with start(files) as asked:
        _, told = asked.communicate()
    assert asked.returncode == 2
    assert "a robot moves only if somebody says so" in told
    assert "Traceback" not in told


def test_a_signal_stops_the_robot_and_leaves_a_log(files, tmp_path):
    """Three at once, since each has to wait until its tool is at the object."""
    plan = fp.plan(parse_scene(mapping_of(SCENE.replace("spacing: 18", "spacing: 18, speed: 4"))))
    plan.save(tmp_path / "plan.json")
    logs = {how: tmp_path / f"{how.name}.csv" for how in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)}
    with ExitStack() as running:
        asked = {
            how: running.enter_context(start(tmp_path, "--yes", "--log", str(log)))
            for how, log in logs.items()
        }
        for how, log in logs.items():
            until(lambda log=log: log.exists() and "segment 1" in log.read_text())
            until(lambda log=log: log.read_text().count("\n") >= 10)
            asked[how].send_signal(how)
        told = {how: one.communicate()[1] for how, one in asked.items()}
    for how, log in logs.items():
        assert "Traceback" not in told[how]
        if how != signal.SIGKILL:
            assert asked[how].returncode == 130
            assert "stopped" in told[how]
            assert log.read_text().endswith("# ended: interrupted\n")
        assert len(load_robot_log(log).runs[0].times) > 3
