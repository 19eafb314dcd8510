"""flatpush simulate --runs, as a user: the report, the files, the cluster, and what is refused."""

import json
import socket

import pytest
from tests.command_line import flatpush
from tests.waiting import python


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    path = tmp_path_factory.mktemp("plan") / "plan.json"
    ended = flatpush("plan", "examples/triangle.yaml", "-o", path)
    assert ended.returncode == 0, ended.stderr
    return path


def test_the_report_tells_where_the_object_ends(plan, tmp_path):
    ended = flatpush(
        "simulate",
        plan,
        "--runs",
        40,
        "--seed",
        7,
        "-o",
        tmp_path / "runs.csv",
        "--figure",
        tmp_path / "t.png",
    )
    assert ended.returncode == 0, ended.stderr
    for words in ("40 runs", "stayed sticking", "mean final pose", "quantiles"):
        assert words in ended.stdout
    assert len((tmp_path / "runs.csv").read_text().splitlines()) == 41
    assert (tmp_path / "t.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_cluster_gives_the_same_numbers_as_one_process(plan):
    alone = flatpush("simulate", plan, "--runs", 120, "--seed", 7, "--json")
    # Its workers are processes as well.
    spread = python("-m", "flatpush", *alone.args[1:], "--cluster", patience=240)
    assert alone.returncode == spread.returncode == 0, spread.stderr
    assert json.loads(alone.stdout) == json.loads(spread.stdout)


@pytest.mark.parametrize("who", ["nobody", "a silent listener", "no address"])
def test_a_scheduler_that_does_not_answer_is_no_hang(plan, who):
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        address = {"nobody": "tcp://127.0.0.1:9", "no address": "nonsense"}.get(
            who, f"tcp://127.0.0.1:{port}"
        )
        ended = flatpush("simulate", plan, "--runs", 5, "--scheduler", address)
    assert ended.returncode == 2
    assert "no Dask scheduler answers" in ended.stderr
    assert "Traceback" not in ended.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--runs", "0"], "--runs is at least 1"),
        (["--runs", "5", "--position", "-1"], "0 or more"),
        (["--runs", "5", "--friction-range", "0.5,0.3"], "LOW ≤ HIGH"),
        (["--runs", "5", "--loads", "20"], "loads of feet"),
        (["--runs", "5", "--df", "2", "--model", "ellipsoid"], "at least 3"),
        (["--runs", "5", "--seed", "-1"], "0 or more"),
    ],
)
def test_what_makes_no_sense_is_refused(plan, words, message):
    ended = flatpush("simulate", plan, *words)
    assert ended.returncode == 2
    assert message in ended.stderr
    assert "Traceback" not in ended.stderr
