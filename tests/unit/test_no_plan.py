"""What is said where there is no plan, or none better in time."""

from dataclasses import replace

import numpy as np

import flatpush as fp
from flatpush.cli.plan import LINES, reason_lines
from flatpush.errors import InputError
from flatpush.problem import Planning


def test_three_lines_at_most_and_one_a_push_in_full():
    pushes = [f"push {k}: it lacks friction" for k in range(5)]
    reason = "no push can steer the object.\n" + "\n".join(pushes)
    full = reason_lines(reason, verbose=True)
    assert full == ["no plan: no push can steer the object.", *(f"  {push}" for push in pushes)]
    short = reason_lines(reason, verbose=False)
    assert len(short) == LINES == 3
    assert short[:2] == full[:2]
    assert short[2] == "  and 4 more, which --verbose or --json tells"
    assert reason_lines("one\ntwo · three", verbose=False) == ["no plan: one", "  two", "  three"]


def test_each_push_has_a_line(rectangle):
    """Without friction to speak of no push steers; every push of the scene is told on a line of its own."""
    smooth = fp.Object(rectangle.outline, "outline", friction=1e-6)
    places = [smooth.outline.nearest([0.0, y]) for y in (-0.1, 0.1)]
    pushes = tuple(fp.Push(f"side {k}", place) for k, place in enumerate(places))
    off = tuple(
        replace(push, at=smooth.outline.nearest(push.at.point + np.array([0.01, 0.0]))) for push in pushes
    )
    found = fp.plan(fp.Scene(smooth, (0.1, 0, 0), pushes=off))
    assert found.status == "no_plan"
    lines = found.reason.split("\n")
    assert lines[0] == "no push can steer the object."
    assert [line.split(":")[0] for line in lines[1:]] == ["side 0", "side 1"]
    assert "array(" not in found.reason


def test_arrays_are_shown_as_lists():
    assert str(InputError("a rule", value=np.array([0.5, 1.0]))) == "a rule, got [0.5, 1.0]"
    assert str(InputError("a rule", value=np.float64(0.25))) == "a rule, got 0.25"


def test_a_search_that_ran_out_of_time_says_so(triangle):
    """A wall with a gap that is too narrow, and no time to find that out."""
    walls = [[(-0.1, y0), (-0.09, y0), (-0.09, y1), (-0.1, y1)] for y0, y1 in ((-0.3, -0.012), (0.012, 0.3))]
    world = fp.problem.Workspace(bounds=(-0.3, -0.3, 0.3, 0.3), obstacles=walls)
    scene = fp.Scene(
        triangle, (-0.2, 0, 0), pusher=fp.Pusher(fingers=2, spacing=0.018), workspace=world,
        planning=Planning(time_limit=1e-6, iterations=10**6),
    )  # fmt: skip
    found = fp.plan(scene)
    assert found.status == "no_plan"
    assert found.reason.startswith("stopped by time_limit after 1e-06 s")
