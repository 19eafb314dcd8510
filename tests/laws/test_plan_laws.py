"""What holds for every plan of one push."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from shapely import Polygon
from tests.conftest import final_error

import flatpush as fp
from flatpush.errors import InputError
from flatpush.geometry import compose, exp, pose_error, transform
from flatpush.planning import Planner
from flatpush.simulation.pieces import pieces
from flatpush.steering import words


def random_scene(seed: int, **planning) -> fp.Scene | None:
    """A convex object on a random support, one finger, a random start within 15 cm."""
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 7)))
    if np.max(np.diff(np.append(angles, angles[0] + 2 * np.pi))) > 2.6:
        return None
    outline = 0.03 * np.column_stack([np.cos(angles), np.sin(angles)]) * rng.uniform(0.5, 1.5, (1, 2))
    feet = fp.Support.points(rng.uniform(-0.012, 0.012, (3, 2)), rng.uniform(0.5, 2, 3))
    support = ("uniform", "outline", feet)[rng.integers(3)]
    thing = fp.Object(outline, support, rng.uniform(0.2, 0.8))
    start = (*rng.uniform(-0.15, 0.15, 2), rng.uniform(-3, 3))
    return fp.Scene(thing, start, planning=fp.Planning(iterations=3300, **planning))


SEEDS = [seed for seed in range(60) if random_scene(seed) is not None][:8]


@pytest.mark.parametrize("seed", [*SEEDS[:3], *(pytest.param(s, marks=pytest.mark.slow) for s in SEEDS[3:])])
def test_an_exact_plan_verifies_and_ends_at_its_goal_in_the_simulator(seed):
    """Default margin, one finger, from the arcs, on the same exact surface: within 0.05 mm and 0.05°."""
    scene = random_scene(seed)
    plan = fp.plan(scene)
    assert plan.status == "solved", plan.reason
    assert fp.verify(plan).ok, fp.verify(plan).failed
    rollout = fp.simulate(plan)
    assert rollout.outcome == "completed"
    distance, turn = final_error(rollout, scene.goal)
    assert distance < 5e-5
    assert turn < np.deg2rad(0.05)


@pytest.mark.parametrize("model", ["ellipsoid", "local", "quartic"])
@pytest.mark.parametrize("seed", SEEDS[:3])
def test_plans_of_every_model_verify_under_their_model(seed, model):
    plan = fp.plan(random_scene(seed, model=model))
    assert plan.status == "solved", plan.reason
    assert fp.verify(plan).ok, fp.verify(plan).failed
    rollout = fp.simulate(plan, model=model)
    assert rollout.outcome == "completed"
    distance, turn = final_error(rollout, plan.scene.goal)
    assert distance < 5e-5
    assert turn < np.deg2rad(0.05)


@pytest.mark.parametrize("cost", ["flat", "pusher", "time"])
def test_the_plan_of_one_push_is_the_cheapest_of_its_words(triangle, cost):
    """Flat, pusher and time costs are what their names say (errata row 10)."""
    push = fp.Push("long edge", triangle.outline.at(2, 0.667), 2, 0.018)
    scene = fp.Scene(
        triangle,
        (0.06, 0.02, 2.356),
        pusher=fp.Pusher(fingers=2, spacing=0.018),
        pushes=(push,),
        planning=fp.Planning(cost=cost),
    )
    plan = fp.plan(scene)
    assert fp.verify(plan).ok, fp.verify(plan).failed
    (option,) = Planner(scene).usable
    car = option.car
    found = words(car.left_centre, car.right_centre, car.direction, scene.start_pose, scene.goal_pose)
    arcs = sum(arc.cost for arc in plan.pushes[0].arcs)
    segment = plan.pushes[0]
    if cost == "pusher":
        steps = np.linalg.norm(np.diff(segment.pusher[:, :2], axis=0), axis=1)
        assert arcs == pytest.approx(steps.sum(), rel=1e-3)
        assert plan.cost == pytest.approx(arcs + 2 * (scene.pusher.lift + scene.pusher.approach))
    elif cost == "time":
        assert plan.cost == pytest.approx(plan.duration)
    else:
        radius = car.radius
        lengths = [radius * (w.parameters[0] + w.parameters[2]) for w in found]
        lengths = [
            n + w.parameters[1] * (1 if w.word[1] == "S" else radius)
            for n, w in zip(lengths, found, strict=True)
        ]
        assert plan.cost == pytest.approx(min(lengths))


@pytest.mark.parametrize(
    ("transit", "cost"),
    [("lift", "flat"), ("planar", "pusher"), ("lift", "time")]
    + [
        pytest.param(*pair, marks=pytest.mark.slow)
        for pair in (("planar", "flat"), ("lift", "pusher"), ("planar", "time"))
    ],
)
def test_many_pushes_verify_are_carried_out_and_are_never_dearer_than_one(triangle, cost, transit):
    scene = fp.Scene(
        triangle,
        (0.06, 0.02, 2.356),
        pusher=fp.Pusher(fingers=2, spacing=0.018, transit=transit),
        planning=fp.Planning(cost=cost, iterations=3300),
    )
    plan = fp.plan(scene)
    assert fp.verify(plan).ok, fp.verify(plan).failed
    distance, turn = final_error(fp.simulate(plan), scene.goal)
    assert distance < 1e-8
    assert turn < 1e-8
    planner = Planner(scene)
    alone = min(
        fp.plan(replace(scene, pushes=(push,))).cost for push in planner.scene.pushes if push is not None
    )
    assert plan.cost <= alone * (1 + 1e-9)
    switches = sum(a.push != b.push for a, b in pairwise(plan.pushes))
    arcs = sum(arc.cost for push in plan.pushes for arc in push.arcs)
    if cost == "flat":
        assert plan.cost == pytest.approx(arcs + 0.03 * switches)
    elif cost == "time":
        assert plan.cost == pytest.approx(plan.duration)
    heights = [segment.height.max() for segment in plan.segments if segment.kind == "transit"]
    assert max(heights) == (0 if transit == "planar" else scene.pusher.lift)


def test_two_runs_agree_but_for_the_run_entry(triangle):
    from flatpush.documents import plan_document

    scene = fp.Scene(triangle, (0.03, 0.05, 0.7))
    documents = [plan_document(fp.plan(scene)) for _ in range(2)]
    for document in documents:
        document.pop("run")
    assert documents[0] == documents[1]


def test_moving_the_scene_moves_the_plan(triangle):
    """Start and goal turned and shifted together: the same push."""

    scene = fp.Scene(triangle, (0.03, 0.05, 0.7))
    X = np.array([0.2, -0.1, 2.0])
    moved = fp.Scene(triangle, compose(X, scene.start), compose(X, scene.goal))
    a, b = fp.plan(scene), fp.plan(moved)
    assert b.cost == pytest.approx(a.cost)
    # Where the push changes is the place of a minimum, known to about the root of rounding.
    assert pose_error(b.pushes[0].object, compose(X, a.pushes[0].object)) == pytest.approx(0, abs=3e-8)


@pytest.mark.slow
def test_bounds_and_obstacles_are_kept_or_there_is_no_plan(triangle):
    start, pusher = (0.0, -0.1, 0.0), fp.Pusher(fingers=2, spacing=0.018)
    free = fp.plan(fp.Scene(triangle, start, pusher=pusher))
    assert free.certificate.clearance is None

    def planned(bounds=None, obstacles=(), clearance=0.0):
        workspace = fp.Workspace(bounds, tuple(np.array(o) for o in obstacles))
        return fp.plan(
            fp.Scene(
                triangle,
                start,
                pusher=pusher,
                workspace=workspace,
                planning=fp.Planning(clearance=clearance, iterations=500, time_limit=60),
            )
        )

    beside = [(0.05, -0.08), (0.06, -0.08), (0.06, 0.0), (0.05, 0.0)]
    kept = planned(obstacles=[beside])
    assert kept.status == "solved"
    from shapely import Polygon

    samples = kept.pushes[0].object
    places = np.linspace(0, len(samples) - 1, 20 * len(samples))
    poses = np.stack([np.interp(places, np.arange(len(samples)), column) for column in samples.T], axis=1)
    gaps = [Polygon(transform(X, triangle.outline.vertices)).distance(Polygon(beside)) for X in poses]
    assert kept.certificate.clearance == pytest.approx(min(gaps), abs=1e-4)
    assert fp.verify(kept).ok
    across = [(-0.1, -0.06), (0.1, -0.06), (0.1, -0.055), (-0.1, -0.055)]
    around = planned(obstacles=[across])
    assert around.certificate.clearance >= 0
    assert around.cost > kept.cost
    assert fp.verify(around).ok
    assert planned(obstacles=[beside], clearance=0.03).certificate.clearance >= 0.03
    with pytest.raises(InputError, match=r"30.35 mm from obstacle 0, and 40.00 mm are asked for"):
        planned(obstacles=[beside], clearance=0.04)
    assert planned(bounds=(-0.08, -0.14, 0.08, 0.08)).status == "solved"
    with pytest.raises(InputError, match=r"outside the left side of the bounds by 4.33 mm"):
        planned(bounds=(-0.035, -0.14, 0.06, 0.06))


def test_clearance_sees_a_needle_between_samples(triangle):
    """A thin obstacle that only an intermediate pose touches."""
    start = (0.0, -0.15, 0.0)
    pusher = fp.Pusher(fingers=2, spacing=0.018)
    for x in (-0.03, 0.0):
        needle = np.array([(x, -0.0901), (x + 1e-6, -0.0901), (x, -0.0899)])
        scene = fp.Scene(
            triangle,
            start,
            pusher=pusher,
            workspace=fp.Workspace(None, (needle,)),
            planning=fp.Planning(iterations=300, time_limit=60),
        )
        plan = fp.plan(scene)
        assert plan.status == "solved", plan.reason
        for piece in pieces(plan.segments, scene.start_pose):
            for f in np.linspace(0, 1, 10):
                shape = Polygon(
                    transform(compose(piece.object, exp(f * piece.object_step)), triangle.outline.vertices)
                )
                assert shape.distance(Polygon(needle)) >= plan.certificate.clearance


def test_a_rolling_finger_reaches_the_goal_by_the_samples(rectangle):
    scene = fp.Scene(rectangle, (0.01, -0.06, 0.2), pusher=fp.Pusher(turns=False, tip_radius=0.003))
    plan = fp.plan(scene)
    assert fp.verify(plan).ok, fp.verify(plan).failed
    assert pose_error(plan.pushes[0].object[-1], scene.goal) == pytest.approx([0, 0, 0], abs=1e-9)
    distance, turn = final_error(fp.simulate(plan), scene.goal)
    assert distance < 5e-5
    assert turn < np.deg2rad(0.05)
    rigid = fp.plan(fp.Scene(rectangle, (0.01, -0.06, 0.2), pusher=fp.Pusher(tip_radius=0.003)))
    assert abs(rigid.cost - plan.cost) > 1e-6
