"""Quasi-static pushing and tipping: from work and moments, and as `describe` tells it."""

import json

import numpy as np
import pytest

from flatpush.cli import main
from flatpush.errors import InputError
from flatpush.friction import Support
from flatpush.problem.assumptions import COASTS, GRAVITY, coasting, quasi_static_speed, tipping_height

FEET = [(-0.02, -0.01), (0.03, -0.01), (0.0, 0.02)]


def test_an_object_coasts_until_friction_has_taken_its_energy():
    for speed, friction in ((0.02, 0.25), (0.1, 0.5)):
        assert friction * GRAVITY * coasting(speed, friction) == pytest.approx(speed**2 / 2)
    assert coasting(quasi_static_speed(0.3), 0.3) == pytest.approx(COASTS)


@pytest.mark.parametrize("weights", [[1, 1, 1], [3, 1, 2]])
def test_at_the_tipping_height_one_foot_at_least_carries_nothing(weights):
    """The loads of three feet follow from force and moments; sliding at height h moves their centre ahead by μ h."""
    support = Support.points(FEET, weights)
    for angle in np.linspace(0, 2 * np.pi, 13):
        ahead = np.array([np.cos(angle), np.sin(angle)])
        height = tipping_height(support, 7 * ahead, 0.4)
        centre = support.centre + 0.4 * height * ahead
        loads = np.linalg.solve(np.vstack([np.transpose(FEET), np.ones(3)]), [*centre, 1.0])
        assert np.min(loads) == pytest.approx(0, abs=1e-12)


def test_a_disc_tips_over_its_rim_and_bad_numbers_are_refused():
    assert tipping_height(Support.disc(0.03, (0.1, 0.0)), [1, 1], 0.5) == pytest.approx(0.06)
    for call in (
        lambda: coasting(-1.0, 0.3),
        lambda: coasting(0.1, 0.0),
        lambda: tipping_height(Support.disc(0.03), [0, 0], 0.5),
        lambda: tipping_height(Support.disc(0.03), [1, 0], np.nan),
    ):
        with pytest.raises(InputError):
            call()


def test_describe_tells_and_warns(tmp_path, monkeypatch, capsys):
    scene = {
        "flatpush": "scene/1", "units": {"length": "mm", "angle": "deg"},
        "object": {"outline": [[-25, -17.5], [25, -17.5], [25, 17.5], [-25, 17.5]], "friction": 0.3},
        "pusher": {"fingers": 1, "speed": 20}, "pushes": [{"name": "low", "at": [0, -17.5]}],
        "start": [0, -50, 0], "goal": [0, 0, 0],
    }  # fmt: skip
    (tmp_path / "scene.json").write_text(json.dumps(scene))

    def said(*words):
        monkeypatch.setattr("sys.argv", ["flatpush", "describe", str(tmp_path / "scene.json"), *words])
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code or 0, *capsys.readouterr()

    status, out, err = said("--table-friction", "0.5", "--height", "40")
    assert status == 0
    assert "coasts 0.041 mm" in out
    assert "lower than 35.0 mm" in out
    assert "push low tips" in err
    assert "quasi-static" not in err
    assert "tips" not in said("--table-friction", "0.5", "--height", "30")[2]
    assert "quasi-static" in said("--table-friction", "0.2")[2]
    assert said("--height", "10")[0] == 2
