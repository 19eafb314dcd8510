"""The recorded two-finger runs: what the simulator predicts with nothing fitted, from contacts, and from other runs."""

import numpy as np
import pytest

from flatpush.experiments import replay


@pytest.fixture(scope="module")
def recorded(data_folder):
    return replay.recorded(data_folder)


def only(recordings, names):
    return [one for one in recordings if one.run.object in names]


def test_every_given_run_is_read_and_halved(recorded):
    runs, _ = recorded
    assert [len(only(runs, [name])) for name in replay.NAMES] == [11, 10, 10, 10]
    assert [len(part) for part in replay.halves(runs)] == [24, 17]


def test_no_recorded_run_is_taken_for_one_of_another_object(recorded):
    """Their tags jump by up to 12 mm, and by 97° in one frame; nothing is calibrated."""
    runs, setup = recorded
    checked = [one.check(setup.objects[one.run.object], setup.fingers, setup.tip_radius) for one in runs]
    assert len(checked) == 41


def test_with_nothing_fitted(recorded):
    runs, setup = recorded
    angular = only(runs, ("bigrect_3pts", "bigrect_ridge", "tri"))
    found = replay.judged("", "", angular, setup, replay.Parameters())
    assert found.lost == 0
    assert found.final[:, 0].mean() <= 1.6e-3
    assert found.final[:, 0].max() <= 2.6e-3
    plan = replay.judged("", "", angular, setup, replay.Parameters(), replay._at_goal)
    assert found.final[:, 0].mean() < plan.final[:, 0].mean()


@pytest.mark.slow
def test_the_contact_alone_calibrates_and_no_end_is_used(recorded):
    runs, setup = recorded
    found = replay.contact_calibration(runs, setup)
    assert found.friction is None
    judged = replay.judged("", "", runs, setup, found)
    assert judged.lost == 0
    assert judged.final[:, 0].mean() <= 1.0e-3


@pytest.mark.slow
def test_what_is_fitted_on_one_half_predicts_the_other(recorded):
    runs, setup = recorded
    one, other = replay.halves(runs)
    judged = replay.judged("", "", other, setup, replay.fitted_on(one, setup))
    assert judged.final[:, 0].mean() <= 0.6e-3
    assert judged.final[:, 0].max() <= 1.5e-3
    assert np.degrees(judged.final[:, 1].mean()) <= 0.5


@pytest.mark.slow
def test_starts_that_nobody_saw_are_predicted_by_the_others(recorded):
    """The numbers of a calibration that count, on all recorded runs: 0.58 mm, at worst 1.74 mm, and 0.45°, from the
    first pose of each; 0.50 mm with what the camera saw around landings."""
    runs, setup = recorded
    first, landed = replay.starts_left_out(runs, setup)
    for case in (first, landed):
        assert len(case.final) == 41
        assert case.final[:, 0].mean() <= 0.6e-3
        assert case.final[:, 0].max() <= 2.2e-3
        assert np.degrees(case.final[:, 1].mean()) <= 0.5
    assert landed.final[:, 0].mean() < 0.9 * first.final[:, 0].mean()
