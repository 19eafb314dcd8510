"""The command line, as a user meets it."""

import json
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.command_line import flatpush
from tests.waiting import python, started

import flatpush as fp

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.yaml"))
SCENE = """
flatpush: scene/1
units: {length: mm, angle: deg}
object: {outline: [[25, -17.5], [25, 17.5], [-25, 17.5], [-25, -17.5]], support: outline, friction: 0.3}
pusher: {fingers: 2, spacing: 18, tip_radius: 2.5}
start: [20, -50, 15]
goal: [0, 0, 0]
"""


# What a shell starts in the background ignores Ctrl-C, and so would its children.
HEEDFUL = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from flatpush.cli import main
main()
"""


def interrupted(arguments, folder, seconds):
    """How flatpush ends after Ctrl-C, so long after its start: status and what it said on stderr."""
    command = [sys.executable, "-c", HEEDFUL, *map(str, arguments)]
    with started(command, cwd=folder, stderr=subprocess.PIPE) as running:
        time.sleep(seconds)
        running.send_signal(signal.SIGINT)
        _, errors = running.communicate()
    return running.returncode, errors


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path


@pytest.fixture(scope="module")
def plans(tmp_path_factory):
    """A folder with plans of the scene, with two fingers and with one, and what making the first printed."""
    folder = tmp_path_factory.mktemp("plans")
    (folder / "two.yaml").write_text(SCENE)
    (folder / "one.yaml").write_text(SCENE.replace("fingers: 2, spacing: 18, ", ""))
    made = [flatpush("plan", f"{n}.yaml", "-o", f"{n}.json", folder=folder) for n in ("two", "one")]
    assert [one.returncode for one in made] == [0, 0], made
    return folder, made[0].stdout


def test_plan_verify_simulate_export(plans, folder):
    there, printed = plans
    assert "certificate" in printed
    shutil.copy(there / "two.json", folder / "plan.json")
    verified = flatpush("verify", "plan.json", folder=folder)
    assert verified.returncode == 0
    assert "verified" in verified.stdout
    simulated = flatpush("simulate", "plan.json", "--json", folder=folder)
    result = json.loads(simulated.stdout)["runs"][0]
    assert result["outcome"] == "completed"
    assert result["distance"] < 1e-6
    exported = flatpush("export", "plan.json", "robot.csv", "--base-frame", "0.3,0,0.1,0", folder=folder)
    assert exported.returncode == 0
    lines = (folder / "robot.csv").read_text().splitlines()
    assert "[m]" in lines[0]
    assert "[rad]" in lines[0]
    document = json.loads((folder / "plan.json").read_text())
    junctions = len(document["segments"]) - 1  # two segments share a pose there
    assert len(lines) - 1 == sum(len(s["times"]) for s in document["segments"]) - junctions


def test_a_bound_tells_how_far_the_plan_is_from_the_best(folder):
    made = flatpush("plan", "scene.yaml", "--bound", "0.2", "-o", "plan.json", folder=folder)
    assert made.returncode == 0
    assert re.search(r"^at most \d+\.\d % above the least possible with these pushes", made.stdout, re.M)
    plan = fp.load_plan(folder / "plan.json")
    assert plan.run["bound"]["least"] <= plan.cost
    assert fp.verify(plan).ok
    walled = SCENE + "workspace: {bounds: [-200, -200, 200, 200]}\n"
    (folder / "scene.yaml").write_text(walled)
    for seconds, words in (("1", "empty table"), ("0", "positive number of seconds")):
        ended = flatpush("plan", "scene.yaml", "--bound", seconds, folder=folder)
        assert ended.returncode == 2
        assert words in ended.stderr


def test_an_edited_plan_fails_verification(plans, folder):
    document = json.loads((plans[0] / "two.json").read_text())
    document["cost"] *= 0.99
    (folder / "plan.json").write_text(json.dumps(document))
    verified = flatpush("verify", "plan.json", folder=folder)
    assert verified.returncode == 4
    assert "cost" in verified.stderr


def test_json_output_is_the_plan_document(folder):
    made = flatpush("plan", "scene.yaml", "--json", "--goal", "5,0,0", "--model", "ellipsoid", folder=folder)
    document = json.loads(made.stdout)
    assert document["flatpush"] == "plan/1"
    assert document["scene"]["goal"] == [0.005, 0.0, 0.0]
    assert document["scene"]["planning"]["model"] == "ellipsoid"


def test_perturbed_runs_report_a_distribution(plans, folder):
    shutil.copy(plans[0] / "one.json", folder / "plan.json")
    runs = flatpush("simulate", "plan.json", "--runs", "3", "--seed", "7", "-o", "runs.json", folder=folder)
    assert runs.returncode == 0, runs.stderr
    assert "3 runs" in runs.stdout
    assert (folder / "runs.json").exists()
    again = flatpush("simulate", "plan.json", "--runs", "3", "--seed", "7", folder=folder)
    assert again.stdout.splitlines()[:2] == runs.stdout.splitlines()[:2]


def test_describe_tells_why_a_push_cannot_steer(folder):
    scene = SCENE + "pushes: [{name: left end, edge: 2, along: 0.75}, {name: corner, edge: 0, along: 0.8}]\n"
    (folder / "scene.yaml").write_text(scene.replace("fingers: 2, spacing: 18, ", ""))
    described = flatpush("describe", "scene.yaml", "--figure", "cones.svg", folder=folder)
    assert described.returncode == 0, described.stderr
    assert "cannot steer" in described.stdout
    assert described.stdout.count("turning radius [mm]: cannot steer under any assumption") == 2
    assert "no push can steer the object" in described.stdout
    (folder / "scene.yaml").write_text(SCENE)
    assert "exact, uniform" in flatpush("describe", "scene.yaml", folder=folder).stdout
    assert (folder / "cones.svg").read_text().startswith("<svg")


def test_init_writes_a_scene_that_plans_and_never_overwrites(folder):
    assert flatpush("init", "new.yaml", folder=folder).returncode == 0
    assert flatpush("plan", "new.yaml", folder=folder).returncode == 0
    again = flatpush("init", "new.yaml", folder=folder)
    assert again.returncode == 2
    assert "not overwritten" in again.stderr


def test_no_friction_is_no_plan(folder):
    (folder / "scene.yaml").write_text(SCENE.replace("friction: 0.3", "friction: 0"))
    made = flatpush("plan", "scene.yaml", "-o", "plan.json", folder=folder)
    assert made.returncode == 3
    assert "without friction" in made.stderr
    assert not (folder / "plan.json").exists()


def test_already_there_is_an_empty_plan(folder):
    made = flatpush("plan", "scene.yaml", "--start", "0,0,360", "-o", "plan.json", folder=folder)
    assert made.returncode == 0, made.stderr
    assert json.loads((folder / "plan.json").read_text())["segments"] == []
    assert flatpush("verify", "plan.json", folder=folder).returncode == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("plan", "missing.yaml"), "missing.yaml"),
        (("plan", "."), "folder|directory"),
        (("plan", "scene.yaml", "--start", "1,2"), "3 numbers"),
        (("plan", "scene.yaml", "--start", "1,2,nan"), "3 numbers"),
        (("plan", "scene.yaml", "--model", "magic"), "model"),
        (("plan", "scene.yaml", "--figure", "plan.bmp"), "svg"),
        (("plan", "scene.yaml", "-o", "nowhere/plan.json"), "nowhere"),
        (("plan",), "Missing argument|SCENE"),
        (("paln",), "paln"),
        (("verify", "scene.yaml"), "plan"),
        (("simulate", "scene.yaml"), "plan"),
        (("simulate", "scene.yaml", "--runs", "0"), "at least 1"),
        (("export", "scene.yaml", "robot.txt"), "csv"),
        (("experiment", "fig99"), "no such experiment"),
    ],
)
def test_bad_usage_is_one_message_and_status_2(folder, arguments, words):
    ended = flatpush(*arguments, folder=folder)
    assert ended.returncode == 2
    assert re.search(words, ended.stderr)
    assert "Traceback" not in ended.stderr
    assert sorted(p.name for p in folder.iterdir()) == ["scene.yaml"]


def test_nothing_takes_the_place_of_what_a_plan_was_read_from(folder, monkeypatch):
    """Of a plan in another folder, which says where its scene and the drawing in it are."""
    monkeypatch.chdir(folder)
    Path("part.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg"><rect width="50" height="35"/></svg>'
    )
    scene = SCENE.replace("[[25, -17.5], [25, 17.5], [-25, 17.5], [-25, -17.5]]", "{file: part.svg}")
    Path("scene.yaml").write_text(scene)
    Path("robot.csv").symlink_to("scene.yaml")
    Path("plans").mkdir()
    before = {name: Path(name).read_text() for name in ("scene.yaml", "part.svg")}

    assert flatpush("plan", "scene.yaml", "-o", "plans/plan.json").returncode == 0
    for arguments, what in (
        (("plan", "scene.yaml", "-o", "same.svg", "--figure", "same.svg"), "another output"),
        (("plan", "scene.yaml", "-o", "part.svg"), "an input"),
        (("simulate", "plans/plan.json", "-o", "scene.yaml"), "an input"),
        (("simulate", "plans/plan.json", "--figure", "part.svg"), "an input"),
        (("track", "plans/plan.json", "--figure", "part.svg"), "an input"),
        (("export", "plans/plan.json", "robot.csv"), "an input"),
        (("run", "plans/plan.json", "--robot", "sim", "--figure", "part.svg"), "an input"),
    ):
        ended = flatpush(*arguments)
        assert (ended.returncode, f"this file is {what}" in ended.stderr) == (2, True), ended
    assert before == {name: Path(name).read_text() for name in before}
    assert not Path("same.svg").exists()


def test_a_full_disk_leaves_no_file(folder):
    """A device that is always full stands for the disk."""
    if not Path("/dev/full").exists():
        pytest.skip("there is no /dev/full on this system")
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000));"
    code = limit + "import signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
    code += "import sys; sys.argv = ['flatpush', 'plan', 'scene.yaml', '-o', 'plan.json'];"
    code += "from flatpush.cli import main; main()"
    ended = python("-B", "-c", code, cwd=folder)
    assert ended.returncode == 2, ended.stderr
    assert "plan.json" in ended.stderr
    assert "Traceback" not in ended.stderr
    assert sorted(p.name for p in folder.iterdir()) == ["scene.yaml"]


def test_interrupting_leaves_no_file(plans, folder):
    shutil.copy(plans[0] / "one.json", folder / "plan.json")
    before = sorted(p.name for p in folder.iterdir())
    ended, errors = interrupted(["simulate", "plan.json", "--runs", 50000, "-o", "runs.json"], folder, 3)
    assert ended == 130
    assert "Traceback" not in errors
    assert sorted(p.name for p in folder.iterdir()) == before


@pytest.mark.slow
def test_interrupting_a_search_among_obstacles_keeps_the_best_plan(folder):
    maze = (ROOT / "examples" / "maze.yaml").read_text(encoding="utf-8")
    (folder / "maze.yaml").write_text(
        maze.replace("planning: {", "planning: {iterations: 1000000, time_limit: 600, ")
    )
    flatpush("plan", "maze.yaml", "--time-limit", "0.01", folder=folder)  # compiles, if need be
    ended, errors = interrupted(["plan", "maze.yaml", "-o", "plan.json"], folder, 15)
    assert ended == 0, errors
    assert "best plan found so far" in errors
    assert flatpush("verify", "plan.json", folder=folder).returncode == 0


DEAR = {"bracket", "l_shape", "maze", "soap", "workshop"}


@pytest.mark.parametrize(
    "example",
    [pytest.param(e, marks=[pytest.mark.slow] * (e.stem in DEAR), id=e.stem) for e in EXAMPLES],
)
def test_every_example_plans_and_verifies(example, tmp_path):
    made = flatpush("plan", example, "-o", "plan.json", folder=tmp_path)
    assert made.returncode == 0, made.stderr
    report = fp.verify(fp.load_plan(tmp_path / "plan.json"))
    assert report.ok, report.failed


def test_help_and_version(tmp_path):
    """In a process of its own, as a user starts it."""
    shown = python("-m", "flatpush", "--help", cwd=tmp_path)
    for command in ("plan", "verify", "simulate", "describe", "export", "init", "experiment"):
        assert command in shown.stdout
    assert "flatpush 0.2.0" in flatpush("--version", folder=tmp_path).stdout


def test_help_loads_nothing_heavy(tmp_path):
    code = (
        "import sys; sys.argv = ['flatpush', '--help']\n"
        "from flatpush.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'scipy', 'numba', 'pydantic', 'yaml', 'matplotlib', 'shapely', 'clarabel'}\n"
        "sys.exit(sorted(heavy & set(sys.modules)) or None)"
    )
    ended = python("-c", code, cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr


def test_a_file_that_is_refused_loads_nothing_heavy(tmp_path):
    """A second went into importing the simulator and the controllers before a misspelt name was told."""
    (tmp_path / "cut.json").write_text('{"flatpush": "plan/1", "segments": [[0, 1')
    (tmp_path / "cut.yaml").write_text("a: [1, 2\nb: {")
    commands = [
        [name, file, *rest]
        for name, kind, *rest in [
            ("verify", "json"), ("simulate", "json"), ("track", "json"), ("export", "json", "out.csv"),
            ("run", "json", "--robot", "sim"), ("plan", "yaml"), ("describe", "yaml"),
            ("calibrate", "csv", "--scene", "cut.yaml", "-o", "out.json"),
        ]
        for file in (f"missing.{kind}", f"cut.{kind}")
    ] + [["view", "missing.yaml"], ["view", "run.csv", "--scene", "missing.yaml"]]  # fmt: skip
    commands += [
        [*words, "--scheduler", "nonsense"]
        for words in (["simulate", "cut.json"], ["demonstrate", "cut.yaml", "-o", "set"])
    ]
    code = (
        "import sys\n"
        "from flatpush.cli import main\n"
        f"for words in {commands}:\n"
        "    sys.argv = ['flatpush', *words]\n"
        "    try: main()\n"
        "    except SystemExit as ended: assert ended.code == 2, words\n"
        "    heavy = {'numpy', 'scipy', 'numba', 'matplotlib', 'shapely', 'flatpush.problem'}\n"
        "    assert not heavy & set(sys.modules), (words, heavy & set(sys.modules))"
    )
    ended = python("-c", code, cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    assert ended.stderr.count("error: ") == len(commands)


def test_a_plan_of_one_push_loads_no_compiler(folder):
    (folder / "scene.yaml").write_text(SCENE + "pushes: [{name: below, edge: 3, along: 0.5}]\n")
    code = (
        "import sys; sys.argv = ['flatpush', 'plan', 'scene.yaml']\n"
        "from flatpush.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "sys.exit(sorted({'numba', 'matplotlib', 'clarabel', 'scipy.optimize'} & set(sys.modules)) or None)"
    )
    ended = python("-c", code, cwd=folder)
    assert ended.returncode == 0, ended.stderr
