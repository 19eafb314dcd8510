"""Objects and scenes that several tests use, and where the recorded data are."""

import gc
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, settings

import flatpush as fp

ROOT = Path(__file__).parents[1]
collect_ignore_glob = ["*_controller.py"]  # programs of their own that tests start

# MuJoCo asks for it when it is first imported, by whichever test; pictures of the cell need no display then.
os.environ.setdefault("MUJOCO_GL", "egl")
# Of pytest-timeout: a test that waits for ever fails instead [s].
os.environ.setdefault("PYTEST_TIMEOUT", "600")

# The same draws in every run.
settings.register_profile("same draws", derandomize=True)
# For tests/mutants.py, which asks only whether a test fails: the failing case need not be made small.
settings.register_profile("not shrunk", derandomize=True, phases=[Phase.explicit, Phase.generate])
settings.load_profile("same draws")


def pytest_collection_finish():
    """What is imported stays: going through it again and again in search of garbage is a part of every test's time."""
    gc.freeze()
    gc.set_threshold(20_000)


@pytest.fixture(scope="session")
def data_folder() -> Path:
    """The folder of recorded data; tests that need it are skipped where it is absent."""
    folder = Path(os.environ.get("FLATPUSH_DATA", ROOT / ".." / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"the recorded data are not in {folder} (set FLATPUSH_DATA)")
    return folder


TRIANGLE = [(0.019667, -0.0095), (0.019667, 0.019), (-0.039333, -0.0095)]
RECTANGLE = [(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)]


@pytest.fixture(scope="session")
def triangle() -> fp.Object:
    return fp.Object(TRIANGLE, friction=0.3, name="triangle")


@pytest.fixture(scope="session")
def rectangle() -> fp.Object:
    return fp.Object(RECTANGLE, "outline", friction=0.3, name="rectangle")


@pytest.fixture(scope="session")
def three_feet() -> fp.Object:
    feet = fp.Support.points([(-0.018, -0.012), (0.02, -0.01), (0.0, 0.014)], [1, 1, 1])
    return fp.Object(RECTANGLE, feet, friction=0.3, name="three feet")


@pytest.fixture(scope="session")
def two_finger_plan(triangle) -> fp.Plan:
    scene = fp.Scene(triangle, (0.06, 0.02, 2.356), pusher=fp.Pusher(fingers=2, spacing=0.018))
    return fp.plan(scene)


@pytest.fixture(scope="session")
def one_finger_plan(rectangle) -> fp.Plan:
    return fp.plan(fp.Scene(rectangle, (0.02, -0.05, 0.3)))


def final_error(rollout: fp.Rollout, goal) -> tuple[float, float]:
    """Distance [m] and angle [rad] from the goal."""
    from flatpush.geometry import pose_error

    error = pose_error(rollout.final_pose, goal)
    return float(np.hypot(error[0], error[1])), abs(float(error[2]))
