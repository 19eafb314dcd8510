"""A plan that is followed under feedback while it is watched."""

import json

import numpy as np
import pytest
from tests.live_pages import CAMERA

from flatpush.control import Camera
from flatpush.control.tracking.simulated_run import TrackedRun
from flatpush.errors import InputError
from flatpush.page.feedback import Followed


def test_a_run_under_feedback_is_that_of_track_however_it_is_cut_up(short):
    plan, _ = short
    whole = TrackedRun(camera=Camera(30, 0.1, 0.0003, np.radians(0.3)), seed=3).of(plan)
    followed, rows, answer = Followed(plan, CAMERA), [], {"outcome": ""}
    for seconds in 50 * (0.017, 0.3, 2.0):
        answer = json.loads(json.dumps(followed.on({"seconds": seconds}), allow_nan=False))
        rows += answer["rows"][bool(rows) :]
        if answer["outcome"]:
            break
    assert answer["outcome"] == whole.outcome
    told = np.array(rows)
    np.testing.assert_allclose(told[:, 0], whole.times, atol=1e-4)
    np.testing.assert_allclose(told[:, 1:4], whole.object * [1e3, 1e3, 1], atol=1e-3)
    np.testing.assert_allclose(told[:, 4:7], whole.pusher * [1e3, 1e3, 1], atol=1e-3)
    np.testing.assert_allclose(told[:, 7], 1e3 * whole.heights, atol=0.01)
    assert (answer["mode"], answer["landings"]) == ("done", 0)


def test_an_object_that_is_moved_by_hand_is_where_it_was_put_and_the_horizon_lands_again(short):
    plan, _ = short
    followed = Followed(plan, {**CAMERA, "controller": "horizon"})
    steps = (followed.on({"seconds": 0.1}) for _ in range(200))
    answer = next(step for step in steps if step["contact"] == "sticks")
    x, y, turn = answer["rows"][-1][1:4]
    answer = followed.on({"seconds": 0.017, "moved": [x - 8, y + 40, turn]})
    assert answer["contact"] == "off the object"
    np.testing.assert_allclose(answer["rows"][-1][1:4], [x - 8, y + 40, turn], atol=1e-3)
    landings = answer["landings"]
    steps = (followed.on({"seconds": 1}) for _ in range(200))
    answer = next(step for step in steps if step["outcome"])
    assert answer["outcome"] == "arrived"
    assert answer["landings"] > landings
    assert np.hypot(*answer["rows"][-1][1:3]) < 2


@pytest.mark.parametrize(
    "wrong",
    [
        {"controller": "luck"},
        {"delay": -1},
        {"delay": 3},
        {"frames": 0},
        {"noise": [1]},
        {"learn": 1},
        {"seed": -1},
        {"seed": True},
    ],
)
def test_a_run_that_is_none_is_refused(short, wrong):
    with pytest.raises(InputError):
        Followed(short[0], {**CAMERA, **wrong})
