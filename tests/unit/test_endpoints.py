"""Starts and goals where the object cannot be are refused by name and measure, before any search."""

import numpy as np
import pytest

import flatpush as fp

SQUARE = fp.Object([(-0.01, -0.01), (0.01, -0.01), (0.01, 0.01), (-0.01, 0.01)])
DISC = fp.Object(fp.Outline.circle(0.01))
BLOCK = [(0.05, -0.02), (0.09, -0.02), (0.09, 0.02), (0.05, 0.02)]
BOUNDS = (-0.2, -0.2, 0.2, 0.2)


def answer(
    start=(0, 0, 0),
    goal=(0, 0.1, 0),
    clearance=0.0,
    obstacles=(BLOCK,),
    bounds=BOUNDS,
    thing=SQUARE,
    **planning,
):
    scene = fp.Scene(
        thing,
        start,
        goal,
        fp.Pusher(fingers=2, spacing=0.01),
        workspace=fp.Workspace(bounds, obstacles),
        planning=fp.Planning(clearance=clearance, iterations=1, **planning),
    )
    return next(iter(fp.Planner(scene).answers()))


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ({"start": (0.07, 0, 0)}, ["at the start", "overlaps obstacle 0 by 10.00 mm"]),
        ({"goal": (0.042, 0, 0)}, ["at the goal", "overlaps obstacle 0 by 2.00 mm"]),
        ({"goal": (-0.195, 0, 0)}, ["at the goal", "outside the left side of the bounds by 5.00 mm"]),
        ({"start": (0, 0.193, 0)}, ["outside the upper side", "3.00 mm"]),
        ({"start": (0.037, 0, 0), "clearance": 0.005}, ["3.00 mm from obstacle 0", "5.00 mm are asked for"]),
        (
            {"start": (0, -0.188, 0), "clearance": 0.005},
            ["2.00 mm from the lower side", "5.00 mm are asked for"],
        ),
        (
            {"obstacles": [fp.Outline.circle(0.02, (0.0, 0.128))]},
            ["at the goal", "overlaps obstacle 0 by 2.00 mm"],
        ),
        ({"thing": DISC, "start": (0.195, 0, 0)}, ["right side", "5.00 mm"]),
    ],
)
def test_an_object_that_cannot_be_there_is_refused(case, words):
    with pytest.raises(fp.InputError) as refused:
        answer(**case)
    for word in words:
        assert word in str(refused.value)


def test_a_cross_is_an_overlap_although_no_corner_is_inside():
    bar = [(-0.1, -0.005), (0.1, -0.005), (0.1, 0.005), (-0.1, 0.005)]
    with pytest.raises(fp.InputError, match="obstacle 1"):
        answer(obstacles=(BLOCK, bar))


def test_touching_is_allowed():
    assert np.isfinite(answer(goal=(-0.03, 0.0, 0.0), obstacles=()).cost)
    answer(start=(0.0, 0.0, 0.0), obstacles=[[(0.01, -0.05), (0.02, -0.05), (0.02, 0.05), (0.01, 0.05)]])
