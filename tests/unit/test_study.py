"""Many disturbed runs: seeded one by one, the same wherever they run, and what is said of their ends."""

import json
from dataclasses import replace

import numpy as np
import pytest

import flatpush as fp
from flatpush.documents import save_runs
from flatpush.errors import InputError
from flatpush.simulation.rollout import roll
from flatpush.view.tube import tube_figure

RECTANGLE = [(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)]


@pytest.fixture(scope="module")
def feet_plan():
    """One finger against a rectangle on three feet."""
    feet = fp.Support.points([(-0.02, -0.012), (0.02, -0.012), (0.0, 0.015)])
    return fp.plan(fp.Scene(fp.Object(RECTANGLE, feet, 0.4), (0.03, -0.05, 0.4)))


def test_a_run_depends_on_its_number_alone(two_finger_plan):
    many, few = (fp.study(two_finger_plan, n, 7, record=True) for n in (60, 5))
    assert np.array_equal(many.object[:5], few.object, equal_nan=True)
    assert many.outcomes[:5] == few.outcomes
    assert not np.array_equal(many.final, fp.study(two_finger_plan, 60, 8).final)
    assert np.array_equal(many.final, fp.study(two_finger_plan, 60, 7, spread=backwards).final)


def backwards(function, chunks):
    return [function(chunk) for chunk in reversed(chunks)][::-1]


def test_without_noise_every_run_is_the_nominal_one(feet_plan):
    quiet = fp.Noise(position=0, angle=0, friction=0)
    runs = fp.study(feet_plan, 3, noise=quiet, record=True)
    nominal = fp.simulate(feet_plan)
    assert np.array_equal(runs.object, np.repeat(nominal.object[None], 3, axis=0))
    assert runs.sticking_share == 1
    assert np.max(np.abs(runs.covariance)) < 1e-20


def test_what_is_drawn_has_the_spread_that_was_asked_for(feet_plan):
    noise = fp.Noise(position=0.001, angle=0.01, friction_range=(0.3, 0.5), centre=0.002, loads=0.2)
    runs = fp.study(feet_plan, 400, 1, noise=noise)
    off = runs.starts - feet_plan.scene.start_pose
    assert np.std(off, axis=0) == pytest.approx([0.001, 0.001, 0.01], rel=0.12)
    assert np.all((runs.frictions >= 0.3) & (runs.frictions <= 0.5))
    assert np.mean(runs.frictions) == pytest.approx(0.4, abs=0.01)
    centres = runs.centres - feet_plan.scene.object.cof
    assert np.std(centres, axis=0) == pytest.approx(
        [0.0022, 0.0022], rel=0.25
    )  # shifts, and loads beside them


def test_summary_is_that_of_the_final_poses(two_finger_plan):
    runs = fp.study(two_finger_plan, 200, 3)
    assert runs.mean == pytest.approx(runs.final.mean(axis=0), abs=1e-9)
    assert runs.covariance == pytest.approx(np.cov(runs.final.T), rel=1e-9, abs=1e-18)
    assert runs.quantiles([0.5])["x"][0] == pytest.approx(np.median(runs.final[:, 0]))
    assert runs.sticking_share == np.mean(runs.sticking)


def test_drawn_ellipsoids_move_the_end(feet_plan):
    quiet = fp.Noise(position=0, angle=0, friction=0, df=1000.0)
    runs = fp.study(feet_plan, 20, noise=quiet, model="ellipsoid")
    assert np.std(runs.final[:, 0]) > 1e-6
    with pytest.raises(InputError, match="no Wishart draw"):
        fp.study(feet_plan, 20, noise=quiet)


def test_many_scenes_at_once_are_each_one_alone(feet_plan):
    scenes = [
        replace(feet_plan.scene, start=feet_plan.scene.start_pose + np.array([0.0, 0.0, 0.01 * k]))
        for k in (-1, 0, 1)
    ]
    together = roll(feet_plan, scenes, "exact", "arcs")
    for k, scene in enumerate(scenes):
        alone = roll(feet_plan, [scene], "exact", "arcs")
        assert np.array_equal(together.object[k], alone.object[0], equal_nan=True)
        assert together.outcomes[k] == alone.outcomes[0]


def test_runs_are_written_and_drawn_whole_or_not_at_all(two_finger_plan, tmp_path):
    runs = fp.study(two_finger_plan, 12, record=True)
    save_runs(runs, tmp_path / "runs.json")
    document = json.loads((tmp_path / "runs.json").read_text())
    assert document["flatpush"] == "runs/1"
    assert [run["final_pose"] for run in document["runs"]] == runs.final.tolist()
    save_runs(runs, tmp_path / "runs.csv")
    rows = (tmp_path / "runs.csv").read_text().splitlines()
    assert len(rows) == 13
    assert len({row.count(",") for row in rows}) == 1
    tube_figure(runs, tmp_path / "tube.svg")
    assert (tmp_path / "tube.svg").read_text().count("<path") > 20
    with pytest.raises(InputError, match="recorded"):
        tube_figure(fp.study(two_finger_plan, 2), tmp_path / "none.svg")
    assert not (tmp_path / "none.svg").exists()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"position": -1.0}, "0 or more"),
        ({"angle": float("nan")}, "finite"),
        ({"loads": 1.0}, "below 1"),
        ({"friction_range": (0.5, 0.3)}, "low ≤ high"),
        ({"df": 2.0}, "3 degrees of freedom"),
    ],
)
def test_noise_that_makes_no_sense_is_refused(wrong, words):
    with pytest.raises(InputError, match=words):
        fp.Noise(**wrong)


def test_studies_that_make_no_sense_are_refused(two_finger_plan):
    with pytest.raises(InputError, match="at least 1 run"):
        fp.study(two_finger_plan, 0)
    with pytest.raises(InputError, match="seed"):
        fp.study(two_finger_plan, 1, -1)
    with pytest.raises(InputError, match="loads of feet"):
        fp.study(two_finger_plan, 1, noise=fp.Noise(loads=0.1))
