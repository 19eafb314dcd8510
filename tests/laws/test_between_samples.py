"""What two fingers do straight between the samples of a plan: an object on feet turns as planned all the same."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.laws.test_table_sets import vertex

import flatpush as fp
from flatpush.contact import PointContact, WrenchCone, cone_twists
from flatpush.contact.cone_twists import MISSED, OFF_CENTRE, RESERVE
from flatpush.friction import Exact, Support
from flatpush.geometry import pose_error
from flatpush.planning import segments
from flatpush.problem.mechanics import surface_of
from flatpush.simulation.claims import NO_RESERVE
from flatpush.simulation.rollout import roll

# Objects whose tightest turns with a fifth in reserve go about a foot, with the side to push at, by (edge, along).
RECTANGLE = fp.Object(
    [(-0.03443, -0.01582), (0.03443, -0.01582), (0.03443, 0.01582), (-0.03443, 0.01582)],
    Support.points([(0.02858, 0.00779), (-0.0127, -0.01044), (-0.007, 0.00948)], [1.41, 1.68, 1.21]),
    0.39,
)
DISC = fp.Object(
    fp.Outline.circle(0.02484),
    Support.points([(-0.01825, -0.0015), (0.01145, 0.01393), (-0.00198, -0.01094)], [1.96, 1.35, 1.13]),
    0.462,
)
CASES = {
    "rectangle": (RECTANGLE, (1, 0.41511756), (-0.01838, 0.14529, math.radians(149.18))),
    "disc": (DISC, (0, 0.42978069), (0.04481, 0.09188, math.radians(-166.55))),
}


def planned(case):
    thing, (edge, along), start = CASES[case]
    push = fp.Push("side", thing.outline.at(edge, along), 2, 0.018)
    scene = fp.Scene(
        thing, start, pusher=fp.Pusher(fingers=2, spacing=0.018, tip_radius=0.0025), pushes=(push,)
    )
    return fp.plan(scene)


def off(plan):
    """How far the object ends from the plan when its samples are executed [m, rad]."""
    run = fp.simulate(plan, source="samples")
    error = pose_error(run.final_pose, plan.pushes[-1].object[-1])
    return math.hypot(*error[:2]), abs(error[2])


@pytest.mark.parametrize("case", CASES)
def test_the_samples_of_a_plan_take_an_object_on_feet_where_it_says(case):
    plan = planned(case)
    assert fp.verify(plan).ok
    distance, angle = off(plan)
    assert distance < 1e-6
    assert angle < 1e-6


def test_samples_too_far_apart_are_refused_though_their_straight_lines_are_near_the_arcs(monkeypatch):
    monkeypatch.setattr(segments, "OFF_CENTRE", 1.0)
    plan = planned("disc")
    assert [claim.name for claim in fp.verify(plan).failed] == [
        "executed: force of two fingers outside their cone"
    ]
    distance, angle = off(plan)
    assert distance > 5e-5 or angle > math.radians(0.05)


def bracket(margin):
    scene = fp.load_scene(Path(__file__).parents[2] / "examples" / "bracket.yaml")
    return fp.plan(replace(scene, planning=replace(scene.planning, friction_margin=margin)))


@pytest.mark.parametrize(("margin", "warned"), [(0.0, True), (RESERVE, False)])
def test_a_plan_without_a_reserve_is_warned_of(margin, warned):
    plan = bracket(margin)
    certificate = plan.certificate
    assert (NO_RESERVE in certificate.warnings) == warned
    assert fp.verify(plan).ok
    # A plan that an older version wrote says nothing of it.
    older = replace(certificate, warnings=tuple(text for text in certificate.warnings if text != NO_RESERVE))
    assert fp.verify(replace(plan, certificate=older)).ok
    other = replace(certificate, warnings=(*certificate.warnings, "look out"))
    assert [claim.name for claim in fp.verify(replace(plan, certificate=other)).failed] == ["warnings"]


@pytest.mark.slow
def test_the_least_reserve_that_is_not_warned_of_keeps_what_no_reserve_loses():
    assert off(bracket(0.0))[0] > 0.01
    assert off(bracket(RESERVE))[0] < 1e-5


@pytest.mark.parametrize("margin", [0.0, 0.2])
def test_the_cone_holds_turns_about_all_points_near_the_planned_centres(margin):
    """By the friction of each of the feet in turns about points around, on random feet."""
    rng = np.random.default_rng(12)
    around = np.stack([np.cos(np.linspace(0, 2 * np.pi, 24)), np.sin(np.linspace(0, 2 * np.pi, 24))], axis=1)
    tried = beside = 0
    for _ in range(40):
        loads, feet = rng.uniform(0.2, 1.0, 4), rng.uniform(-0.02, 0.02, (4, 2))
        surface = Exact(Support.points(feet - loads @ feet / np.sum(loads), loads))
        mu = rng.uniform(0.2, 0.6)
        contacts = [
            PointContact([x + rng.uniform(-0.003, 0.003), -0.018], [0, 1], mu) for x in (-0.009, 0.009)
        ]
        try:
            twists = cone_twists(contacts, surface, margin, np.array([[0.0, -0.0205]]))
        except fp.NoDubinsReduction:
            continue
        cone = WrenchCone.of(contacts)
        for V in twists[[0, 2]]:
            centre = np.array([-V[1], V[0]]) / V[2]
            for share in (0.3, 0.999):
                for x, y in centre + share * OFF_CENTRE * around:
                    assert cone.depth(surface.wrench(np.sign(V[2]) * np.array([y, -x, 1.0]))) >= -1e-9
            gaps = np.hypot(*(surface.support.feet[0] - centre).T)
            tried, beside = tried + 1, beside + bool(np.min(gaps) < 4 * OFF_CENTRE)
    assert tried > 30
    assert beside > 3


@pytest.mark.slow
def test_a_plan_for_a_set_of_tables_holds_when_its_samples_are_executed():
    """On tables at corners of the set, with the least friction that its reserve allows for: planned for turns about the
    centres of its arcs alone it kept both fingers along those and slipped between samples, on a third of the tables."""
    outline = [(0.0291, 0.0094), (0.0037, 0.0291), (-0.0254, 0.0165), (-0.0293, 0.009), (0.0088, -0.028)]
    feet, loads = [(0.0045, 0.0047), (-0.0128, 0.0055), (0.003, 0.0078)], np.array([0.364, 0.315, 0.321])
    thing = fp.Object(outline, fp.Support.points(feet, loads), friction=0.4, uncertainty=fp.Uncertainty(0.2))
    pusher = fp.Pusher(fingers=2, spacing=0.014)
    plan = fp.plan(
        fp.Scene(thing, (0.029, -0.009, 1.473), pusher=pusher, planning=fp.Planning(iterations=300))
    )
    assert plan.certificate.set_margin >= 0
    rng, scenes = np.random.default_rng(0), []
    for friction in np.repeat((0.32, 0.4), 20):
        table = fp.Support.points(feet, vertex(loads, 0.2, rng.normal(size=3)))
        worse = replace(thing, support=table, friction=float(friction), uncertainty=None)
        scenes.append(replace(plan.scene, object=worse))
    for source in ("arcs", "samples"):
        assert np.all(roll(plan, scenes, "exact", source).sticking)


@pytest.mark.parametrize(
    ("model", "margin", "missed"),
    # A quartic bends sharply between the directions that are looked at, too.
    [("quartic", 0.25, 0.5), ("quartic", 0.0, 1.5), ("local", 0.25, 1e-6), ("local", 0.0, 1.05)],
)
def test_smooth_surfaces_that_bend_sharply_are_held_about_all_points_near_the_planned_centres(
    model, margin, missed
):
    """Of random feet: with a margin, or to within the degree that a plan without one misses."""
    rng = np.random.default_rng(13)
    angles = np.linspace(0, 2 * np.pi, 24)
    square = [(-0.03, -0.03), (0.03, -0.03), (0.03, 0.03), (-0.03, 0.03)]
    tried, least = 0, 1.0
    for _ in range(12):
        feet, loads = 0.025 * rng.uniform(-1, 1, (3, 2)), rng.uniform(0.5, 2.0, 3)
        thing = fp.Object(square, Support.points(feet, loads), 0.25)
        surface = surface_of(thing, model, np.array([0.0, 1.0]))
        contacts = [PointContact(np.array([x, -0.03]) - thing.cof, [0, 1], 0.25) for x in (-0.015, 0.015)]
        try:
            twists = cone_twists(contacts, surface, margin, np.array([[0.0, -0.0325]]) - thing.cof)
        except fp.NoDubinsReduction:
            continue
        cone = WrenchCone.of(contacts)
        for V in twists[[0, 2]]:
            shifts = OFF_CENTRE * V[2] * np.stack([np.sin(angles), -np.cos(angles), 0 * angles], axis=1)
            least = min(least, float(np.min(cone.depth(surface.wrench(V + shifts)))))
            tried += 1
    assert tried > 10
    assert least >= -missed * math.sin(MISSED)
