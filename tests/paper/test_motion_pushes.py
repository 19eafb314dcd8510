"""The recorded force pushes without their forces: loads and friction from poses predict pushes left out."""

import numpy as np
import pytest

from flatpush.experiments import motion_pushes


def test_ways_of_the_finger_begin_and_end_at_the_block(data_folder):
    """In nearly all pushes the straight way meets both outlines, and pushes inwards."""
    assert len(motion_pushes.experiments(data_folder)) == 6
    pushes = motion_pushes.read(data_folder, "hardboard_3pts3")
    assert len(pushes.ways) >= 48
    way = pushes.stretches.tips[:, -1] - pushes.stretches.tips[:, 0]
    block = pushes.stretches.ends[:, :2] - pushes.stretches.starts[:, :2]
    assert np.mean(np.sum(way * block, axis=1) > 0) > 0.95


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hardboard_3pts3", "plywood_3pts4"])
def test_motion_tells_about_as_much_as_forces_do(data_folder, name):
    judged = motion_pushes.judge_motion(motion_pushes.read(data_folder, name), name)
    mean = {
        key: np.rad2deg(np.mean(getattr(judged, key))) for key in ("finger", "wrench", "wrench_by_forces")
    }
    assert mean["finger"] < 7.5
    assert mean["wrench"] < mean["wrench_by_forces"] + 1
    assert judged.friction.mean() == pytest.approx(0.5, abs=0.05)
