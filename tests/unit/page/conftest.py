"""Scenes and plans of the live page."""

import json

import pytest
from tests.live_pages import SCENE

import flatpush as fp
from flatpush.documents import mapping_of, parse_scene
from flatpush.page.in_mm import scene_in_mm
from flatpush.page.live import LivePlanner


@pytest.fixture
def document():
    return scene_in_mm(parse_scene(mapping_of(SCENE)))


@pytest.fixture(scope="module")
def planner():
    return LivePlanner()


@pytest.fixture(scope="module")
def short():
    """A plan of one push with one finger, and the document of its scene."""
    thing = "{name: block, outline: [[-25, -20], [25, -20], [25, 20], [-25, 20]], friction: 0.4}"
    scene = parse_scene(
        mapping_of(
            f"flatpush: scene/1\nunits: {{length: mm, angle: deg}}\nobject: {thing}\n"
            "pusher: {fingers: 1, tip_radius: 3}\npushes: [{name: short side, at: [-25, 0]},"
            " {name: above, at: [0, 20]}, {name: right, at: [25, 0]}, {name: below, at: [0, -20]}]\n"
            "start: [-30, 3, 0]\ngoal: [0, 0, 0]\n"
        )
    )
    plan = fp.plan(scene)
    return plan, json.loads(json.dumps(scene_in_mm(plan.scene)))
