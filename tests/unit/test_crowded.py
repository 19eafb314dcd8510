"""Scenes full of obstacles: that they can be solved, and that they are."""

import re
from dataclasses import replace

import numpy as np
import pytest

import flatpush as fp
from flatpush.errors import InputError
from flatpush.experiments.crowded import SCENES, carved, many_obstacles, narrow_passage
from flatpush.planning import Planner
from flatpush.planning.assembly import assemble
from flatpush.simulation.clearance import clearance_of


def planned(scene, **planning):
    return Planner(
        replace(scene, planning=replace(scene.planning, time_limit=60, **planning)),
    ).plan()


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 6))]
)
def test_the_path_that_a_scene_is_carved_along_keeps_clear(seed):
    """By the judge, with landing, leaving and all transits; so there is a plan whatever the planner finds."""
    found = carved(seed)
    transits = Planner(found.scene).transits
    segments = assemble(found.scene, transits, found.options, found.path)
    assert clearance_of(found.scene, segments) > 0.0005
    end = segments[-2].object[-1]
    assert np.allclose(end, found.scene.goal_pose, atol=1e-9)
    again = carved(seed).scene
    assert np.array_equal(again.goal, found.scene.goal)
    assert len(again.workspace.obstacles) == len(found.scene.workspace.obstacles) >= 1


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_is_solved(name):
    plan = planned(SCENES[name](), iterations=300)
    assert plan.status == "solved"
    assert plan.certificate.clearance >= 0
    assert fp.verify(plan).ok


def test_a_gap_too_narrow_for_the_object_ends_with_what_was_tried():
    plan = planned(narrow_passage(0.03), iterations=60)
    assert plan.status == "no_plan"
    width = re.search(r"no way is wider than ([\d.]+) mm, and the object is 35.0 mm wide", plan.reason)
    assert width
    assert float(width[1]) == pytest.approx(30.0, abs=0.1)


def test_two_hundred_obstacles_are_two_hundred():
    scene = many_obstacles()
    assert len(scene.workspace.obstacles) == 200
    blocked = replace(scene, start=(*scene.workspace.obstacles[3].centroid, 0.0))
    with pytest.raises(InputError, match="at the start the object"):
        planned(blocked)
