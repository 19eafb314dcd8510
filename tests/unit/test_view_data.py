"""Pictures of data: limit surfaces, comparisons, recorded runs."""

import numpy as np
import pytest

from flatpush.friction import Ellipsoid
from flatpush.friction.cross_validation import Judgement
from flatpush.friction.pairs import Pairs
from flatpush.view import palette
from flatpush.view.angle_figure import draw_angles
from flatpush.view.drawing import MARKS, Disc, Line, Look, Text, mark
from flatpush.view.replay_figure import ReplayRow, draw_replay
from flatpush.view.surface_figure import draw_surfaces


def test_a_section_of_a_surface_is_its_curve_and_holds_the_data_near_it():
    """The ellipse of an ellipsoid in the plane without torque, drawn in newtons, and a pair on each axis."""
    matrix = np.diag([1 / 4.0, 1.0, 1 / (3 * 0.02) ** 2])  # half axes 2 N, 1 N, 3 N times the length
    wrenches = np.array([[2.0, 0, 0], [0, 1.0, 0], [0, 0, 0.06]])
    pairs = Pairs(wrenches, Ellipsoid(matrix).twist(wrenches), "made")
    page = draw_surfaces({"ellipsoid": (Ellipsoid(matrix), 1.0)}, pairs, 0.02, "surfaces", "")
    curves = [
        i for _, i in page.items() if isinstance(i, Line) and i.look.width == 1.6 and len(i.points) > 100
    ]
    assert len(curves) == 3
    ratios = [np.ptp(curve.points[:, 0]) / np.ptp(curve.points[:, 1]) for curve in curves]
    np.testing.assert_allclose(ratios, [2 / 1, 2 / 3, 1 / 3], rtol=1e-3)
    dots = [item for _, item in page.items() if isinstance(item, Disc) and item.look.fill == "#1a1a1a"]
    assert len(dots) == 2 * 3 + 1  # two of the three pairs in each section, and the legend
    said = {text.text for text in page.texts()}
    assert {"section without torque", "fx [N]", "30° or more", "ellipsoid"} <= said


@pytest.mark.parametrize("kind", list(MARKS))
def test_a_mark_lies_about_its_middle(kind):
    item = mark(kind, np.array([10.0, 20.0]), 3.0, Look(fill="#111111"))
    if isinstance(item, Disc):
        assert item.radius == 3.0
        return
    np.testing.assert_allclose(item.points.mean(axis=0), [10.0, 20.0], atol=1e-9)
    reach = np.linalg.norm(item.points - [10.0, 20.0], axis=1).max()
    assert 3.0 <= reach <= 4.0


def test_every_recorded_run_is_a_mark_and_the_bar_is_their_mean():
    errors = np.array([[0.001, 0.1, 0.002], [0.003, 0.3, 0.004], [0.005, 0.2, 0.003]])
    rows = [
        ReplayRow("one\nfitted: nothing", ("disc", "disc", "bar"), errors),
        ReplayRow("two", ("bar",), errors[:1]),
    ]
    page = draw_replay(rows, ["disc", "bar"], "replay")
    fills = [palette.push_colour(k) for k in range(2)]
    marks = [i for _, i in page.items() if not isinstance(i, Text) and i.look.fill in fills]
    assert len(marks) == 3 * 4 + 2  # and the legend
    bars = [i for _, i in page.items() if isinstance(i, Line) and i.look.width == 1.6]
    discs = [i for _, i in page.items() if isinstance(i, Disc) and i.radius == 2.0]
    squares = [i for _, i in page.items() if isinstance(i, Line) and i.look.fill == fills[1]]
    first = [*(d.centre[0] for d in discs[:2]), squares[0].points[:, 0].mean()]
    assert bars[0].points[0, 0] == pytest.approx(np.mean(first))
    assert {"one", "fitted: nothing", "two", "angle at the end [°]"} <= {text.text for text in page.texts()}


def test_means_and_intervals_of_models_stand_where_they_are():
    """Two models, one always off by 0.1 rad, the other by 0.2 and 0.4: its interval lies about 17.2°."""
    rng = np.random.default_rng(1)
    spread = np.where(rng.random((1, 60)) < 0.5, 0.2, 0.4)
    twists = np.ones((60, 3))
    judged = {
        "wood": {
            "quartic": Judgement("quartic", twists, np.full((1, 60), 0.1), 0.02),
            "ellipsoid": Judgement("ellipsoid", twists, spread, 0.02),
        }
    }
    page = draw_angles(judged, "angles")
    (disc,) = (i for _, i in page.items() if isinstance(i, Disc) and i.radius == 2.6)
    (square,) = (
        i
        for _, i in page.items()
        if isinstance(i, Line) and i.look == Look("#ffffff", 0.5, fill=palette.GOAL)
    )
    (spreads,) = (
        i for _, i in page.items()
        if isinstance(i, Line) and i.look == Look(palette.GOAL, 1.4) and np.ptp(i.points[:, 0]) > 25
    )  # fmt: skip
    zero = next(t for t in page.texts() if t.text == "0").x
    scale = (disc.centre[0] - zero) / np.degrees(0.1)
    place = square.points[:, 0].mean()
    assert (place - zero) / scale == pytest.approx(np.degrees(spread.mean()), rel=1e-6)
    low, high = spreads.points[:, 0]
    half = 1.96 * np.degrees(spread.std()) / np.sqrt(60)
    assert low < place < high
    assert (high - low) / scale == pytest.approx(2 * half, rel=0.2)
