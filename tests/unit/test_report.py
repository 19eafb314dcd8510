"""The whole paper as one page: its sections, their order, and what a missing extra or folder makes of them."""

import os
import re
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor, as_completed
from html import unescape

import numpy as np
import pytest
from tests.command_line import flatpush
from tests.extras import extra
from tests.waiting import started

from flatpush.cli import main
from flatpush.contact import PointContact
from flatpush.experiments import EXPERIMENTS, duality, experiment
from flatpush.experiments.everything import _FIND as FINDS
from flatpush.experiments.everything import SECTIONS, Done, Job, compute, everything, in_processes
from flatpush.experiments.finding import Finding, Row
from flatpush.experiments.report import page
from flatpush.friction import Ellipsoid

HOME = "flatpush.experiments.everything"


def found(job: Job) -> Done:
    return Done(
        job, Finding((Row(job.name, "<1 mm", "2 & 3", "why"),), (("a.svg", "<svg/>"),), job.name), 1.0
    )


def backwards(function, jobs, told):
    """Every job in a thread, started from the last."""
    with ThreadPoolExecutor(4) as pool:
        futures = {pool.submit(function, job): job for job in reversed(jobs)}
        done = {}
        for future in as_completed(futures):
            done[futures[future]] = future.result(60)
            told(done[futures[future]])
    return [done[job] for job in jobs]


def test_sections_stand_in_their_order_wherever_they_were_computed(monkeypatch):
    monkeypatch.setattr(f"{HOME}.compute", found)
    told = []
    sections = everything(True, None, backwards, told.append)
    assert [done.job.name for _, done in sections] == [section.name for section in SECTIONS]
    assert sorted(done.job.name for done in told) == sorted(section.name for section in SECTIONS)
    by_name = {done.job.name: done for _, done in sections}
    text = page(by_name, "this machine", True)
    assert re.findall(r'<section id="([\w-]+)">', text) == [section.name for section in SECTIONS]
    assert "&lt;1 mm" in text
    assert "2 &amp; 3" in text
    assert "quick edition" in text
    assert "quick edition" not in page(by_name, "", False)
    # Nothing is fetched: every link stays in the page, every picture is in it.
    assert set(re.findall(r'(?:src|href)="([^"]{4})', text)) <= {
        "data",
        *(f"#{s.name}"[:4] for s in SECTIONS),
    }
    assert text.count("data:image/svg+xml;base64,PHN2Zy8+") == len(SECTIONS)


def test_an_experiment_that_fails_leaves_the_report_of_the_others(monkeypatch, tmp_path):
    def fails(quick, data):
        raise ZeroDivisionError("a mistake")

    monkeypatch.setitem(FINDS, "fig3", fails)
    monkeypatch.setattr(f"{HOME}.in_processes", lambda count: backwards)
    monkeypatch.setattr(f"{HOME}.compute", lambda job: compute(job) if job.name == "fig3" else found(job))
    ended = flatpush("experiment", "all", "-o", tmp_path / "report")
    assert ended.returncode == 1
    assert "fig3 (failed: ZeroDivisionError: a mistake)" in ended.stderr
    text = (tmp_path / "report" / "index.html").read_text("utf-8")
    assert "This experiment failed: ZeroDivisionError: a mistake" in text
    assert 'raise ZeroDivisionError("a mistake")' in unescape(text)  # where, for whoever mends it
    assert text.count("2 &amp; 3") == len(SECTIONS) - 1


def test_what_is_done_stays_when_the_rest_is_interrupted(monkeypatch, tmp_path):
    def interrupted(function, jobs, told):
        for job in jobs[:3]:
            told(function(job))
        raise KeyboardInterrupt

    monkeypatch.setattr(f"{HOME}.in_processes", lambda count: interrupted)
    monkeypatch.setattr(f"{HOME}.compute", found)
    ended = flatpush("experiment", "all", "-o", tmp_path / "report")
    assert ended.returncode == 130
    text = (tmp_path / "report" / "index.html").read_text("utf-8")
    assert text.count("2 &amp; 3") == 3
    assert text.count("not computed yet") == len(SECTIONS) - 3


def test_a_process_that_dies_ends_its_own_experiment():
    told = []
    (done,) = in_processes(1)(os._exit, [3], told.append)
    assert told == [done]
    assert "terminated abruptly" in done.finding.failed


INTERRUPTED = """
import signal, time
signal.signal(signal.SIGINT, signal.default_int_handler)
from flatpush.experiments.everything import in_processes
in_processes(2)(time.sleep, [0, 60, 60], lambda done: print("begun", flush=True))
"""


def test_ctrl_c_ends_all_processes_at_once():
    with started(
        [sys.executable, "-c", INTERRUPTED], 60, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as it:
        assert it.stdout.readline() == "begun\n"
        os.killpg(it.pid, signal.SIGINT)  # as a terminal does
        _, said = it.communicate(timeout=50)  # of the 60 s that the processes would have slept
    assert said.rstrip().endswith("KeyboardInterrupt")
    assert "Process Spawn" not in said


def test_every_section_is_an_experiment_of_its_own():
    assert {section.name for section in SECTIONS} <= set(EXPERIMENTS)


@pytest.mark.parametrize("name", ["replay", "stored-graphs"])
def test_a_section_without_its_data_says_so(name):
    done = compute(Job(name, quick=True))
    assert "--data" in done.finding.missing
    assert not done.finding.rows
    assert done.finding.missing in page({name: done}, "", True)


def test_rotation_centres_lie_on_the_line_and_poses_come_back_from_any_point_of_it(tmp_path):
    """Both another way: a turn about the centre moves the contact as u = J A Jᵀ f, and the path is retraced."""
    text = experiment("duality")(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"figs1_2.svg", "proposition1.svg", "theorem1.svg"}
    assert text.count("Theorem 1,") == 3
    at = duality.contact(duality.PLACES["2 mm beside it"])
    for force, centre in zip(*duality.centres(at), strict=True):
        jacobian = np.array([[1.0, 0.0, -at.point[1]], [0.0, 1.0, at.point[0]]])
        u = jacobian @ duality.SURFACE.matrix @ jacobian.T @ force
        assert u @ (at.point - centre) == pytest.approx(0, abs=1e-12 * np.hypot(*u))
    assert max(duality.line_errors().values()) < 1e-12
    for off, share in duality.recovered().values():
        assert off < 1e-9
        assert share < 1e-9


def test_a_matrix_that_is_not_of_the_paper_s_form_breaks_the_line(monkeypatch):
    """So the picture of Proposition 1 shows something: with A22 ≠ A11 the centres are no longer at ρ/r."""
    monkeypatch.setattr(duality, "SURFACE", Ellipsoid(np.diag([1.0215, 1.6, 1936.73])))
    assert duality.line_errors()["2 mm beside it"] > 1e-5
    assert isinstance(duality.contact((0.0, -0.018)), PointContact)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("all",), "folder"),
        (("all", "fig3", "-o", "report"), "other experiments"),
        (("all", "--runs", "3", "-o", "report"), "--runs"),
        (("fig3", "--quick"), "--quick"),
        (("fig3", "-o", "report"), "--figures FOLDER"),
        (("fig3", "--figures", "no/such"), "no such folder"),
        (("all", "-o", "no/such/report"), "no such folder"),
        (("all", "-o", "report", "--data", "nowhere"), "recorded data"),
    ],
)
def test_what_all_refuses(words, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["flatpush", "experiment", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert told in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_cluster_finds_what_this_process_does_and_tells_when():
    """The answers stand in the order of the jobs, whichever comes first."""
    pytest.importorskip("distributed", reason=extra("cluster"))
    from flatpush.cli.cluster import cluster

    jobs, told = [Job("fig3", quick=True), Job("duality", quick=True)], []
    with cluster(None) as spread:
        done = spread(compute, jobs, told.append)
    assert [one.job for one in done] == jobs
    assert {one.job.name for one in told} == {"fig3", "duality"}
    assert [one.finding.rows for one in done] == [compute(job).finding.rows for job in jobs]
