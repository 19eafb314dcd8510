"""Plans of pushes that slide, from scene to robot: planned, proved, followed, drawn; refused where nothing turns."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import flatpush as fp
from flatpush.cli import main
from flatpush.control.tracking.simulated_run import TrackedRun
from flatpush.documents import export_csv, parse_plan, plan_document
from flatpush.errors import InputError
from flatpush.geometry import Outline, pose_error, transform
from flatpush.planning.bound import bounded
from flatpush.simulation.plant import Plant

BRICK = [(-0.03, -0.02), (0.03, -0.02), (0.03, 0.02), (-0.03, 0.02)]
# Where a slide and then a push cost less than either alone.
MIXED = (0.0242, 0.0294, -1.1663)


def slippery(**changes) -> fp.Scene:
    """A brick without friction; fields of the scene by their names."""
    return replace(fp.Scene(fp.Object(BRICK, friction=0.0), (0.07, 0.03, 0.9)), **changes)


@pytest.fixture(scope="module")
def plan():
    return fp.plan(slippery())


@pytest.fixture(scope="module")
def around():
    """Beside a post and between walls, the finger never lifted."""
    post = [(0.035, 0.055), (0.045, 0.055), (0.045, 0.065), (0.035, 0.065)]
    return fp.plan(
        slippery(
            pusher=fp.Pusher(transit="planar"),
            workspace=fp.Workspace((-0.1, -0.1, 0.15, 0.12), (post,)),
            planning=fp.Planning(clearance=0.001),
        )
    )


def ends(plan, pose, friction=0.0, cof=None):
    """Where the slides of a plan take the object from a pose: a plant of our own, straight from end to end."""
    scene = plan.scene
    plant = Plant(scene.object, [[0.0, 0.0]], scene.pusher.tip_radius, friction=friction, cof=cof)
    for slide in plan.slides:
        pose = plant.follow(pose, slide.pusher[[0, -1]]).object[-1]
    return pose


def test_a_slippery_brick_is_brought_to_its_goal(plan):
    assert plan.status == "solved"
    assert not plan.pushes
    assert [s.kind for s in plan.segments] == ["transit", "slide"] * len(plan.slides) + ["transit"]
    assert fp.verify(plan).ok
    end = ends(plan, plan.scene.start_pose)
    assert np.allclose(pose_error(end, plan.final_pose()), 0, atol=1e-5)
    assert np.all(np.abs(plan.scene.goal_error(end)) <= plan.scene.planning.goal_tolerance)
    run = fp.simulate(plan)
    assert run.outcome == "completed"
    assert np.allclose(run.final_pose, plan.final_pose(), atol=1e-6)
    assert {"sliding_left", "sliding_right"} & set(run.modes)


def test_the_cost_is_the_way_of_the_finger_and_30_mm_a_change(plan):
    ways = [np.linalg.norm(s.pusher[-1, :2] - s.pusher[0, :2]) for s in plan.slides]
    assert plan.cost == pytest.approx(sum(ways) + 0.03 * (len(ways) - 1), rel=1e-9)


def test_the_document_holds_it_and_reads_back(plan):
    document = json.loads(json.dumps(plan_document(plan)))
    kinds = [s["kind"] for s in document["segments"]]
    assert kinds.count("slide") == len(plan.slides) >= 2
    assert fp.verify(parse_plan(document), scene=slippery()).ok


@pytest.mark.parametrize(
    "changes",
    [{"pusher": fp.Pusher(fingers=2, spacing=0.01)}, {"planning": fp.Planning(slides="never")}],
    ids=["two fingers", "never"],
)
def test_a_scene_without_slides_refuses_them(plan, changes):
    """Also where the digest of its scene was taken out of the plan."""
    report = fp.verify(replace(plan, scene=slippery(**changes), scene_digest=""))
    assert [claim.name for claim in report.failed] == ["executed: slides where the scene has none"]


def test_sensitivity_is_what_the_plant_does(plan):
    """By rollouts with other steps: a start 0.2 mm aside in any direction, 0.2° turned, friction of 0.005."""
    outline, start = plan.scene.object.outline.vertices, plan.scene.start_pose
    there = transform(ends(plan, start), outline)

    def moved(pose, **changes):
        return np.max(np.linalg.norm(transform(ends(plan, pose, **changes), outline) - there, axis=1))

    angles = np.arange(0.0, 2 * np.pi, np.pi / 4)
    away = 2e-4 * np.column_stack([np.cos(angles), np.sin(angles)])
    turn = np.deg2rad(0.2)
    cof = plan.scene.object.cof
    found = {
        "place": max(moved(start + [*off, 0.0]) for off in away) / 2e-4,  # noqa: RUF005
        "turn": max(moved(start + np.array([0, 0, s * turn])) for s in (-1, 1)) / turn,
        "friction": moved(start, friction=0.005) / 0.005,
        "centre": max(moved(start, cof=cof + off) for off in away) / 2e-4,
    }
    for name, value in plan.certificate.sensitivity.items():
        assert value == pytest.approx(found[name], rel=0.15), name
    assert plan.certificate.sensitivity["place"] > 1.0


def test_no_bound_is_known_of_slides(plan):
    with pytest.raises(InputError, match="this plan's slide"):
        next(bounded(fp.Planner(plan.scene), plan))


def test_slides_never_leaves_it_at_no_plan():
    refused = fp.plan(slippery(planning=fp.Planning(slides="never")))
    assert refused.status == "no_plan"
    assert "no push can steer the object.\n" in refused.reason


def test_listed_pushes_are_kept_to():
    """A scene that lists its pushes is not pushed elsewhere, unless slides are asked for."""
    thing = fp.Object(BRICK, friction=0.0)
    pushes = (fp.Push("side", thing.outline.at(0, 0.5)),)
    assert fp.plan(slippery(pushes=pushes)).status == "no_plan"
    assert fp.plan(slippery(pushes=pushes, planning=fp.Planning(slides="join"))).slides


def test_a_disc_that_nothing_turns_is_told():
    surface = fp.Ellipsoid(np.diag([1.0, 1.0, 2000.0]))
    disc = fp.Object(Outline.circle(0.03), friction=0.0, surface=surface)
    asked = fp.Scene(disc, (0.05, 0.0, 0.3))
    refused = fp.plan(asked)
    assert refused.status == "no_plan"
    assert "no push of this finger turns the object" in refused.reason
    assert fp.plan(replace(asked, goal=(0.0, 0.0, "free"))).status == "solved"


@pytest.mark.slow
def test_slides_never_make_a_plan_costlier():
    """Nor do slides and cars in one plan."""
    starts = ((-0.0226, -0.0374, -0.9401), (-0.0117, 0.0073, -0.8316), (0.0573, -0.0795, 0.2605), MIXED)
    kinds = []
    for start in starts:
        thing = fp.Object(BRICK, friction=0.2)
        alone = fp.plan(fp.Scene(thing, start))
        both = fp.plan(fp.Scene(thing, start, planning=fp.Planning(slides="join")))
        assert fp.verify(both).ok
        assert both.cost <= alone.cost
        kinds.append({s.kind for s in both.segments} - {"transit"})
        assert both.cost < alone.cost or kinds[-1] == {"push"}
    assert {"slide", "push"} in kinds


@pytest.mark.slow
def test_a_slide_and_a_push_in_one_plan(tmp_path):
    """Rolled out by a plant of our own they end at the goal; the yaw goes on, and the document reads back."""
    thing = fp.Object(BRICK, friction=0.2)
    plan = fp.plan(fp.Scene(thing, MIXED, planning=fp.Planning(slides="join")))
    kinds = [s.kind for s in plan.segments if s.kind != "transit"]
    assert kinds[0] == "slide"
    assert set(kinds[1:]) == {"push"}
    plant, pose = Plant(thing, [[0.0, 0.0]], plan.scene.pusher.tip_radius), plan.scene.start_pose
    for segment in plan.segments:
        if segment.kind != "transit":
            pose = plant.follow(pose, segment.pusher).object[-1]
    assert np.all(np.abs(plan.scene.goal_error(pose)) <= [2e-3, 2e-3, np.deg2rad(2)])
    for before, after in pairwise(plan.segments):
        assert np.allclose(before.pusher[-1], after.pusher[0], atol=1e-9)
    assert fp.verify(parse_plan(json.loads(json.dumps(plan_document(plan))))).ok


@pytest.mark.slow
def test_one_finger_goes_around_on_the_table_and_keeps_its_clearance(around):
    assert around.status == "solved"
    assert fp.verify(around).ok
    assert all(not s.height.any() for s in around.segments if s.kind == "transit")
    assert around.certificate.clearance >= 0.001


@pytest.mark.slow
@pytest.mark.parametrize("which", ["plan", "around"])
def test_track_looks_after_each_slide_and_arrives(which, request):
    """The finger has a friction that nobody told, the start is off and the camera is noisy."""
    found = request.getfixturevalue(which)
    tracked = TrackedRun(friction=0.03, start=(0.002, -0.001, 0.05), seed=1)
    run = tracked.of(found)
    assert run.outcome == "arrived"
    assert np.all(np.abs(found.scene.goal_error(run.object[-1])) <= [5e-4, 5e-4, np.deg2rad(0.5)])
    assert run.modes.count("look") >= len(found.slides)
    assert len(run.times) == len(run.object) == len(run.heights) == len(run.modes) == len(run.contacts)
    assert np.all(np.diff(run.times) >= 0)
    if which == "plan":  # the hand is lifted, and goes through its places without a jump
        steps = np.linalg.norm(np.diff(run.pusher[:, :2], axis=0), axis=1)
        assert np.max(steps) < 0.03


def test_figures_show_slides_by_dashes(plan, tmp_path):
    for name in ("plan.svg", "plan.html"):
        save = tmp_path / name
        from flatpush.view import save_figure

        save_figure(plan, save)
        assert (
            "slides: path of the centre" if name == "plan.svg" else 'class="flat slide"'
        ) in save.read_text()


def test_a_robot_gets_the_slides(plan, tmp_path):
    rows = export_csv(plan, tmp_path / "robot.csv")
    table = np.loadtxt(tmp_path / "robot.csv", delimiter=",", skiprows=1)
    assert rows == len(table)
    last = plan.slides[-1].pusher[-1]
    assert np.min(np.linalg.norm(table[:, 1:3] - last[:2], axis=1)) < 1e-9
    assert table[-1, 0] == pytest.approx(plan.duration)


def test_many_runs_of_slides_do_not_say_that_they_stuck(plan, tmp_path, monkeypatch, capsys):
    """They said: stayed sticking 100.0 %."""
    plan.save(tmp_path / "plan.json")
    figure = tmp_path / "tube.svg"
    words = ["flatpush", "simulate", str(tmp_path / "plan.json"), "--runs", "3", "--figure", str(figure)]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    told = capsys.readouterr().out + figure.read_text()
    assert "3 runs" in told
    assert "off the goal in the median" in told
    assert "stayed sticking" not in told
