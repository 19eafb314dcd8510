"""Scenes that say how well pressure and friction are known: plans that hold on every table of that set."""

from dataclasses import replace

import numpy as np
import pytest

import flatpush as fp
from flatpush.contact import proved_twists
from flatpush.documents import load_plan, scene_document
from flatpush.documents.reading import mapping_of
from flatpush.documents.scene_reader import parse_scene
from flatpush.errors import InputError
from flatpush.geometry import perpendicular
from flatpush.problem.certificate import SetBounds

SCENE = {
    "flatpush": "scene/1",
    "units": {"length": "mm", "angle": "deg"},
    "object": {
        "outline": [[25, -17.5], [25, 17.5], [-25, 17.5], [-25, -17.5]],
        "friction": 0.4,
        "uncertainty": {"loads": 0.15, "friction": [0.35, 0.5], "offset": 0.3},
    },
    "pusher": {"fingers": 2, "spacing": 18},
    "pushes": [{"name": "long", "at": [0, -17.5]}, {"name": "short", "at": [25, 0]}],
    "start": [60, -120, 45],
    "goal": [0, 0, 0],
}


def changed(**uncertainty):
    return {**SCENE, "object": {**SCENE["object"], "uncertainty": uncertainty}}


@pytest.fixture(scope="module")
def plan():
    return fp.plan(parse_scene(SCENE))


def test_a_plan_is_proved_for_the_set_that_the_scene_states(plan, tmp_path):
    certificate = plan.certificate
    assert certificate.set_margin >= 0
    assert certificate.set_loads >= 0.15
    again = fp.prove(plan, 0.15, friction=0.35, offset=0.0003)
    assert again.proved
    assert again.margin == pytest.approx(certificate.set_margin)
    assert certificate.set_uniqueness > 0
    assert certificate.set_bounds == SetBounds(0.15, 0.35, 0.0003)
    worst = certificate.set_worst
    assert worst.push == plan.pushes[worst.number].push
    assert certificate.set_margin <= worst.depth < certificate.set_margin + 0.04
    plan.save(tmp_path / "plan.json")
    loaded = load_plan(tmp_path / "plan.json")
    assert (loaded.certificate.set_worst, loaded.certificate.set_bounds) == (worst, certificate.set_bounds)
    assert loaded.scene.object.uncertainty == fp.Uncertainty(0.15, (0.35, 0.5), 0.0003)
    assert fp.verify(loaded).ok


@pytest.mark.slow
def test_the_offset_along_the_fingers_is_kept_clear():
    """An object that may stand aside by a millimetre needs it beside obstacles; the nominal plan does not keep it."""
    wall = [[-100, 19], [100, 19], [100, 30], [-100, 30]]
    crowded = {**changed(offset=1.0), "workspace": {"obstacles": [wall]}, "planning": {"iterations": 300}}
    plan = fp.plan(parse_scene(crowded))
    certificate = plan.certificate
    assert certificate.clearance >= 0.001
    assert certificate.set_clearance == pytest.approx(certificate.clearance - 0.001)
    assert sum(certificate.set_end) == pytest.approx(0.001)
    assert fp.verify(plan).ok
    near = {**crowded, "workspace": {"obstacles": [[[x, y - 1.2] for x, y in wall]]}}
    with pytest.raises(
        InputError, match=r"at the goal .* 0.30 mm from obstacle 0, and 1.00 mm .* offset along"
    ):
        fp.plan(parse_scene(near))
    nominal = replace(plan.scene, planning=replace(plan.scene.planning, proof="nominal"))
    tight = fp.plan(replace(nominal, workspace=fp.Workspace(obstacles=[np.array(wall) / 1000 - [0, 0.0012]])))
    assert tight.certificate.set_clearance < 0
    believed = replace(tight, scene=replace(tight.scene, planning=plan.scene.planning))
    assert "clearance kept" in [claim.name for claim in fp.verify(believed).failed]


def test_a_nominal_plan_is_cheaper_and_fails_the_proof(plan):
    scene = replace(plan.scene, planning=replace(plan.scene.planning, proof="nominal", friction_margin=0.0))
    nominal = fp.plan(scene)
    assert nominal.cost < plan.cost
    assert nominal.certificate.set_margin < 0
    believed = replace(nominal, scene=replace(scene, planning=replace(scene.planning, proof="set")))
    assert "set_margin kept" in [claim.name for claim in fp.verify(believed).failed]


def test_verify_recomputes_what_is_said_of_the_set(plan):
    """Of tables that are as bad as each other any may be named; plans of before name none."""
    stated = plan.certificate

    def failed(**changes):
        lie = replace(plan, certificate=replace(stated, **changes))
        return [claim.name for claim in fp.verify(lie).failed]

    worst = stated.set_worst
    loads = np.array(worst.loads)
    evened = tuple((0.5 * (loads + 1 / len(loads))).tolist())
    assert failed(set_worst=replace(worst, loads=evened)) == ["set_worst"]
    assert failed(set_worst=replace(worst, loads=tuple((1.2 * loads).tolist()))) == ["set_worst"]
    assert failed(set_worst=replace(worst, depth=worst.depth + 1e-4)) == ["set_worst"]
    assert failed(set_worst=replace(worst, gives_way="nothing")) == ["set_worst"]
    assert failed(set_worst=replace(worst, offset=2 * stated.set_bounds.offset)) == ["set_worst"]
    assert failed(set_worst=replace(worst, number=len(plan.pushes))) == ["set_worst"]
    assert failed(set_worst=replace(worst, face=(1.0, 0.0, 0.0))) == ["set_worst"]
    assert failed(set_bounds=SetBounds(0.2, 0.35, 0.0003)) == ["set_bounds"]
    assert failed(set_uniqueness=0.9) == ["set_uniqueness"]
    assert not failed(set_worst=None, set_bounds=None, set_uniqueness=None)


def test_the_larger_the_set_the_wider_the_turns():
    radii = []
    for share in (0.0, 0.1, 0.3):
        scene = parse_scene(changed(loads=share))
        car = fp.Planner(scene).options[0].car
        radii.append(car.radius)
        assert car.straight[:2] @ perpendicular(car.left_centre - car.right_centre) == pytest.approx(
            -np.linalg.norm(car.left_centre - car.right_centre), rel=1e-6
        )
    assert radii == sorted(radii)
    assert radii[2] > 1.05 * radii[0]


def test_pushes_sought_for_the_set_are_not_taken_for_the_nominal_table():
    """Candidates are remembered by object, and were so whatever was to be proved."""
    scene = parse_scene({**changed(loads=0.3), "pushes": "auto", "pusher": {"fingers": 1}})
    feet = fp.Support.points([(-0.02, -0.01), (0.02, -0.01), (0.0, 0.012)])
    scene = replace(scene, object=replace(scene.object, support=feet))
    nominal = replace(scene, planning=replace(scene.planning, proof="nominal"))
    assert not fp.Planner(scene).usable
    assert len(fp.Planner(nominal).usable) == 4


def test_a_refused_push_names_what_breaks_its_proof_only_where_that_is_read(monkeypatch):
    """What breaks a proof takes a search, which no plan by another push should wait for."""
    scene = parse_scene(changed(loads=0.5, offset=8.0))
    asked, search = [], proved_twists._broken
    monkeypatch.setattr(proved_twists, "_broken", lambda *given: asked.append(given) or search(*given))
    refused = fp.Planner(scene).options[0]
    assert refused.car is None
    assert not asked
    assert "a car remains with an offset up to" in refused.refusal
    assert len(asked) == 1
    plan = fp.plan(scene)
    assert plan.status == "no_plan"
    assert refused.refusal in plan.reason


def test_one_finger_is_refused_with_what_would_do():
    one = {**changed(loads=0.1), "pusher": {"fingers": 1}}
    plan = fp.plan(parse_scene(one))
    assert plan.status == "no_plan"
    assert "one finger cannot be proved" in plan.reason
    one["planning"] = {"proof": "nominal"}
    assert fp.plan(parse_scene(one)).certificate.set_margin is None


@pytest.mark.parametrize(
    ("uncertainty", "message"),
    [
        ({"loads": 1.0}, "loads"),
        ({"loads": -0.1}, "loads"),
        ({"friction": [0.5, 0.6]}, "contains the object's own"),
        ({"friction": [0.5, 0.3]}, "low"),
        ({"offset": -1}, "offset"),
        ({"weight": 0.1}, "unknown key"),
        ({}, "states loads, friction, offset or start"),
        ({"friction": []}, "at least 2 entries"),
        ({"offset": "0.5 mm"}, "without its unit"),
        ({"start": {}}, "states position or angle"),
        ({"start": {"position": -1}}, "position"),
        ({"start": {"position": "2 mm"}}, "without its unit"),
        ({"start": {"position": 200}}, "as far as the object is long, 61.03 mm"),
        ({"start": {"angle": 50}}, "at most 45°"),
        ({"start": {"angle": ".nan"}}, "angle"),
        ({"start": [2, 2]}, "start"),
        ({"start": {"place": 2}}, "unknown key"),
    ],
)
def test_sets_that_make_no_sense(uncertainty, message):
    with pytest.raises(fp.InputError, match=message) as refused:
        parse_scene(changed(**uncertainty))
    assert refused.value.key.startswith("object.uncertainty")


def test_a_start_whose_offsets_reach_an_obstacle_is_refused():
    """Itself it is 0.7 mm away; the fingers may stand 1 mm beside their place."""
    wall = [[60, -80], [120, -80], [120, -70], [60, -70]]
    scene = {**changed(offset=1.0), "start": [60, -98.2, 0], "workspace": {"obstacles": [wall]}}
    with pytest.raises(InputError, match=r"0.70 mm from obstacle 0, and 1.00 mm .* offset along") as refused:
        fp.plan(parse_scene(scene))
    assert refused.value.key == "start"


def test_an_offset_on_a_round_side_is_refused_with_its_length():
    scene = {**changed(offset=0.2), "pushes": "auto"}
    scene["object"]["outline"] = {"circle": 25}
    reason = fp.plan(parse_scene(scene)).reason
    assert "here 0.2 mm, needs two fingers on one straight side" in reason


@pytest.mark.parametrize("text", ["20 %", "20%", "20.0 %"])
def test_a_share_may_be_written_in_per_cent(text):
    """As a file says it; the scene, and so the plan, holds the number."""
    document = mapping_of(f"flatpush: scene/1\nobject: {{uncertainty: {{loads: {text}}}}}\n")
    scene = parse_scene(changed(**document["object"]["uncertainty"]))
    assert scene.object.uncertainty.loads == 0.2
    assert scene_document(scene)["object"]["uncertainty"]["loads"] == 0.2


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("120 %", "less than 100 %"),
        ("100 %", "less than 100 %"),
        ("-5 %", "at least 0 %"),
        ("20 mm", "a number or in per cent"),
        ("20", "a number or in per cent"),
        ("%", "a number or in per cent"),
        ("", "a number or in per cent"),
        ("nan %", "a number or in per cent"),
        ("1e999 %", "a number or in per cent"),
    ],
)
def test_what_is_no_share_is_refused_with_its_place(text, rule):
    with pytest.raises(InputError, match=rule) as refused:
        parse_scene(changed(loads=text))
    assert refused.value.key == "object.uncertainty.loads"
    assert refused.value.value == text


@pytest.mark.parametrize(
    ("outline", "fingers", "message"),
    [
        ({"circle": 25}, 2, "a disc has no straight side"),
        (SCENE["object"]["outline"], 1, "one finger does not"),
    ],
)
def test_a_start_region_is_for_two_fingers_on_straight_sides(outline, fingers, message):
    scene = {
        **changed(start={"position": 1}),
        "pushes": "auto",
        "pusher": {"fingers": fingers, "spacing": 18},
    }
    scene["object"]["outline"] = outline
    with pytest.raises(InputError, match=message) as refused:
        parse_scene(scene)
    assert refused.value.key == "object.uncertainty.start"
    assert "feedback" in refused.value.hint
    around = {**changed(start={"position": 1}), "pusher": {"fingers": 2, "spacing": 18, "transit": "planar"}}
    around["object"]["outline"] = SCENE["object"]["outline"]
    with pytest.raises(InputError, match="go around the object") as refused:
        parse_scene(around)
    assert refused.value.key == "pusher.transit"


def test_a_start_region_about_an_origin_far_away_is_refused():
    """It was turned about the outline's centroid instead, once that had become the origin."""
    scene = changed(start={"position": 1, "angle": 1})
    scene["object"]["outline"] = [[x + 9000, y] for x, y in SCENE["object"]["outline"]]
    with pytest.raises(InputError, match="turned about the drawing's origin, and that is 9 m"):
        parse_scene({**scene, "pushes": "auto"})


def test_a_start_region_is_read_in_the_units_of_the_file_and_written_in_si():
    scene = parse_scene(changed(start={"position": 2, "angle": 1.5}))
    region = scene.object.uncertainty.start
    assert (region.position, region.angle) == pytest.approx((0.002, np.deg2rad(1.5)))
    again = parse_scene(scene_document(scene))
    assert again.object.uncertainty == scene.object.uncertainty


def test_a_known_surface_has_no_loads():
    scene = changed(loads=0.1)
    scene["object"]["surface"] = {"ellipsoid": [[1, 0, 0], [0, 1, 0], [0, 0, 2000]]}
    with pytest.raises(fp.InputError, match="no loads that could differ"):
        parse_scene(scene)
