"""Objects that start anywhere in a region: what is left of it after a landing, and plans that end at the goal."""

from dataclasses import replace
from itertools import product
from re import search

import numpy as np
import pytest
import shapely

import flatpush as fp
from flatpush.contact.landing import Landing, _moments, _turning_distance, carried, landing
from flatpush.contact.table_set import TableSet
from flatpush.documents import load_plan
from flatpush.documents.scene_reader import parse_scene
from flatpush.geometry import pose_error, relative, rotate
from flatpush.planning.assembly import assemble
from flatpush.planning.obstacles import check_endpoints
from flatpush.planning.path import Path
from flatpush.problem.mechanics import placement_of, side_of
from flatpush.simulation import certify
from flatpush.simulation.clearance import clearance_of, object_distances
from flatpush.simulation.rollout import roll
from flatpush.simulation.tube import check_landing, tube_of
from flatpush.view.plan_figure import tube_bands

RECTANGLE = [(0.025, -0.0175), (0.025, 0.0175), (-0.025, 0.0175), (-0.025, -0.0175)]
FEET = [(-0.018, -0.012), (0.02, -0.01), (0.004, 0.014), (-0.02, 0.008)]
REGION = fp.StartRegion(0.002, float(np.deg2rad(2.0)))
PUSHER = fp.Pusher(fingers=2, spacing=0.018, approach=0.004)


def scene_of(region=REGION, outline=RECTANGLE, support=None, start=(0.06, 0.02, 2.5), **more):
    feet = fp.Support.points(FEET, [1, 1.2, 1, 0.8]) if support is None else support
    thing = fp.Object(outline, feet, friction=0.4, uncertainty=fp.Uncertainty(0.1, None, 0.0, region))
    places = {"long": (-0.0015, -0.0175), "short": (0.025, -0.0009)}
    if outline is RECTANGLE and "pushes" not in more:
        more["pushes"] = tuple(
            fp.Push(name, thing.outline.nearest(at), 2, 0.018) for name, at in places.items()
        )
    return fp.Scene(thing, start, pusher=PUSHER, planning=fp.Planning(iterations=100), **more)


def starts(scene, count, rng):
    """Corners of the region first: places on the rim of the disc with the angle at either end; then from inside."""
    region = scene.object.uncertainty.start
    found = [(a, region.position, s * region.angle) for a, s in product(np.arange(8) * np.pi / 4, (-1, 1))]
    found += [
        (
            rng.uniform(0, 2 * np.pi),
            region.position * np.sqrt(rng.uniform()),
            rng.uniform(-1, 1) * region.angle,
        )
        for _ in range(count - len(found))
    ]
    return [scene.start_pose + np.array([r * np.cos(a), r * np.sin(a), turn]) for a, r, turn in found[:count]]


def run_from(plan, start, friction=0.4, loads=None):
    """The plan in the plant, from another start, with other fingers and on another table."""
    thing = replace(plan.scene.object, uncertainty=None, friction=friction)
    if loads is not None:
        thing = replace(thing, support=fp.Support.points(thing.support.feet[0], loads))
    return fp.simulate(replace(plan, scene=replace(plan.scene, object=thing, start=start)))


def pressed(scene, on=((0, 0, 0.5), (0, 1, 0.02))):
    """A plan of one push that begins straight for 12 mm."""
    planner = fp.Planner(scene)
    path = Path.of(planner.fleet, scene.start_pose, [(0, 1, 0.012), *on])
    scene = replace(planner.scene, goal=path.poses[-1])
    segments = assemble(scene, planner.transits, planner.usable, path)
    certificate = certify(scene, segments)
    return fp.Plan("solved", scene, certificate.cost, certificate.duration, segments, certificate)


@pytest.fixture(scope="module")
def plan():
    return fp.plan(scene_of())


def side_and_tables(scene, share=0.1):
    push = fp.Push("side", scene.object.outline.nearest((0.0, -0.0175)), fingers=2, spacing=0.018)
    return side_of(scene, placement_of(scene, push)), TableSet.of(scene.object.support, share)


def test_without_an_angle_only_what_lies_along_the_side_is_left():
    scene = scene_of()
    side, tables = side_and_tables(scene)
    left = landing(tables, scene.object.cof, side, fp.StartRegion(0.002, 0.0), 0.0)
    assert (left.offset, left.gap, left.travel) == pytest.approx((0.002, 0.002, 0.002))
    at = carried(side, rotate(np.pi / 3, side.along), 0.002, 0.0)
    assert (at.offset, at.gap) == pytest.approx((0.001, 0.002 * np.sin(np.pi / 3)))
    tilted = carried(side, side.normal, 0.002, 0.1)
    assert tilted.offset == pytest.approx(0.002 * np.tan(0.1))


def test_a_larger_region_leaves_more_and_never_less_than_the_angle_at_the_depth():
    scene = scene_of()
    side, tables = side_and_tables(scene)
    found = []
    for degrees in (0.0, 1.0, 2.0, 4.0):
        angle = np.deg2rad(degrees)
        left = landing(tables, scene.object.cof, side, fp.StartRegion(0.001, angle), 0.0)
        assert left.offset >= 0.001 + 0.0175 * np.tan(angle) * (1 - 1e-12)
        found.append((left.offset, left.gap, left.travel))
    assert np.all(np.diff(found, axis=0) > 0)


def moment_of(tables, z, c):
    """The greatest Σ w z · (z - c) / |z - c| of loads at points z (n, 2)."""
    q = np.sum(z * (z - c), axis=1) / np.linalg.norm(z - c, axis=1)
    order, loads = np.argsort(q), tables.weights
    middle = q[order[np.searchsorted(np.cumsum(loads[order]), 0.5)]]
    return loads @ (q + tables.share * np.abs(q - middle))


@pytest.mark.parametrize("step", [0.5, 1e-4])
@pytest.mark.parametrize(("kind", "patches"), [("feet", 0), ("outline", 12), ("uniform", 12)])
def test_a_moment_is_bounded_between_directions_between_places_and_within_patches(kind, patches, step):
    """Directions half a radian apart, touched points 4 mm, against all that lies between; then patches alone."""
    support = scene_of(support=None if kind == "feet" else kind).object.support
    fine, coarse = TableSet.of(support, 0.3, 1_000), TableSet.of(support, 0.3, patches)
    wander = 0.008 * step
    touched = np.array([-0.008, -0.018]) + wander * np.array([(-1, 0), (0, 0), (1, 0)])
    for first, Y in product(np.arange(-0.1, 1.5, 0.5), np.geomspace(0.005, 1.0, 12)):
        turns = np.array([first, first + step])
        e = np.stack([np.cos(turns), np.sin(turns)], axis=1)
        most = np.max(_moments(coarse, coarse.points - touched[:, None], e, step, wander, Y))
        for turn, aside in product(first + step * np.array([0.05, 0.3, 0.5, 0.8]), np.linspace(-1, 1, 7)):
            z = fine.points - (touched[1] + (aside * wander, 0.0))
            assert moment_of(fine, z, Y * np.array([np.cos(turn), np.sin(turn)])) <= most + 1e-12


@pytest.mark.parametrize("wander", [0.0, 0.0015])
@pytest.mark.parametrize(
    ("kind", "share", "patches", "above"),
    [("feet", 0.0, 0, 1.05), ("feet", 0.3, 0, 1.05), ("outline", 0.3, 40, 1.1), ("uniform", 0.3, 40, 1.3)],
)
def test_the_turning_distance_is_that_of_a_finger_that_sticks(kind, share, patches, above, wander):
    """Against the root of the moment about the finger by brute force, on the worst loads of points that press: it is
    never nearer, whatever the direction and wherever the touched point has got to, and little further."""
    feet = fp.Support.points([(-0.02, -0.01), (0.02, -0.01), (0.0, 0.02)])
    scene = scene_of(support=feet if kind == "feet" else kind)
    side, _ = side_and_tables(scene)
    cof = scene.object.cof
    found = _turning_distance(TableSet.of(scene.object.support, share, patches), cof, side, 0.0, wander)
    fine = TableSet.of(scene.object.support, share, 3_000)
    worst = 0.0
    for place, aside in product(side.fingers, (-wander, -0.6 * wander, 0.3 * wander, wander)):
        z = fine.points + cof - (place + aside) * side.along + side.depth * side.normal
        inward = -np.sign(place) * side.along
        for lift in np.linspace(0, np.pi / 2, 37):
            e = np.cos(lift) * inward + np.sin(lift) * side.normal
            low, high = worst, 1.0
            while high - low > 1e-5:
                half = 0.5 * (low + high)
                low, high = (half, high) if moment_of(fine, z, half * e) > 0 else (low, half)
            worst = low
    assert worst <= found <= above * worst


def test_a_plan_ends_at_the_goal_from_every_start(plan, tmp_path):
    """Single pushes would be cheaper; the region asks for a second side."""
    certificate = plan.certificate
    assert len(plan.pushes) == 2
    assert [part.push for part in certificate.tube] == [push.push for push in plan.pushes]
    assert certificate.tube[0].offset > 0.002
    assert np.all(np.array(certificate.set_end) <= plan.scene.planning.goal_tolerance[:2])
    for part, push in zip(certificate.tube, plan.pushes, strict=True):
        assert push.arcs[0].turn == "straight"
        assert push.arcs[0].duration * np.hypot(*push.arcs[0].twist[:2]) >= part.travel
    assert certificate.set_margin >= 0
    plan.save(tmp_path / "plan.json")
    loaded = load_plan(tmp_path / "plan.json")
    assert loaded.certificate.tube == certificate.tube
    assert loaded.scene.object.uncertainty == plan.scene.object.uncertainty
    assert fp.verify(loaded).ok
    for start in starts(plan.scene, 3, np.random.default_rng(1)):
        error = np.abs(plan.scene.goal_error(run_from(plan, start).final_pose))
        assert np.all(error <= [*(np.array(certificate.set_end) + 1e-6), 1e-6])


def test_verify_recomputes_the_tube(plan):
    certificate = plan.certificate
    less = replace(certificate.tube[0], offset=0.5 * certificate.tube[0].offset)
    lie = replace(plan, certificate=replace(certificate, tube=(less, *certificate.tube[1:])))
    assert "tube" in [claim.name for claim in fp.verify(lie).failed]
    known = fp.Uncertainty(0.1, None, 0.0, fp.StartRegion(0.0022, 0.036))
    wider = replace(plan.scene, object=replace(plan.scene.object, uncertainty=known))
    failed = {claim.name: claim for claim in fp.verify(replace(plan, scene=wider)).failed}
    assert "goes straight for" in str(failed["tube"].recomputed)
    once = pressed(plan.scene)
    assert "tube ends at the goal" in [claim.name for claim in fp.verify(once).failed]


def test_the_band_in_the_figure_is_the_tube(plan):
    """Each centre of friction, from any start, lies in the band of its push once both fingers hold."""
    disc, *bands = tube_bands(plan)
    assert len(bands) == len(plan.pushes)
    assert shapely.Polygon(disc).area == pytest.approx(np.pi * 0.002**2, rel=0.1)
    run = run_from(plan, starts(plan.scene, 1, np.random.default_rng(0))[0])
    end = shapely.Point(run.object[-1, :2] + rotate(run.object[-1, 2], plan.scene.object.cof))
    assert shapely.Polygon(bands[-1]).buffer(1e-5).covers(end)


@pytest.mark.slow
@pytest.mark.parametrize(("support", "friction"), [(None, (0.4, 0.12)), ("uniform", (0.4, 0.2))])
def test_one_landing_leaves_no_more_than_is_said(support, friction):
    """In the plant, with much and little friction of the fingers: only an offset along the side is left, within the
    bound, and corners of the region come near to it, so that it is not much too wide, but for what the hand goes along
    the side on its way: that is bounded by the longest way of all tables, and this one's is shorter. (It goes on
    straight: with less friction than was planned for it would slip in turns.)"""
    plan = pressed(scene_of(support=support), [(0, 1, 0.02)])
    things = [replace(plan.scene.object, uncertainty=None, friction=mu) for mu in friction]
    begins = starts(plan.scene, 40, np.random.default_rng(3))
    scenes = [replace(plan.scene, object=thing, start=begin) for begin in begins for thing in things]
    rolled = roll(plan, scenes, "exact", "arcs")
    errors = relative(plan.scene.goal_pose, rolled.final)
    side = side_of(plan.scene, placement_of(plan.scene, plan.scene.pushes[0]))
    assert np.max(np.abs(errors[:, 2])) <= 1e-6
    assert np.max(np.abs(errors[:, :2] @ side.normal)) <= 1e-6
    worst, (part,) = np.max(np.abs(errors[:, :2] @ side.along)), plan.certificate.tube
    along = part.travel * abs(np.tan(side.tilt(plan.pushes[0].arcs[0].twist[:2])))
    assert 0.85 * (part.offset - along) <= worst <= part.offset


@pytest.mark.slow
@pytest.mark.parametrize("crowded", [False, True])
def test_from_two_hundred_starts_and_tables_a_plan_ends_in_its_region_and_keeps_clear(crowded):
    """Corners of the region and of the loads first; a random object, and one with an obstacle beside its way."""
    rng = np.random.default_rng(18)
    if crowded:
        wall = [(0.075, -0.06), (0.09, -0.06), (0.09, 0.035), (0.075, 0.035)]
        scene = scene_of(start=(0.15, 0.02, 2.5), workspace=fp.Workspace((-0.2, -0.2, 0.3, 0.2), [wall]))
    else:
        sides = np.array(RECTANGLE) * rng.uniform(1.0, 1.3, 2)
        feet = fp.Support.points(sides * rng.uniform(0.6, 0.9, (4, 1)), rng.uniform(0.9, 1.1, 4))
        scene = scene_of(outline=sides, support=feet)
    plan = fp.plan(scene)
    assert plan.status == "solved", plan.reason
    assert fp.verify(plan).ok
    points, weights = plan.scene.object.support.feet
    corners = [
        loads
        for signs in product((-1.0, 1.0), repeat=len(weights) - 1)
        for k in range(len(weights))
        for loads in [weights * (1 + 0.1 * np.insert(signs, k, 0.0))]
        if abs(rest := weights.sum() - loads.sum()) <= 0.1 * weights[k] + 1e-12
        for loads in [loads + rest * (np.arange(len(weights)) == k)]
    ]
    scenes = []
    for i, begin in enumerate(starts(plan.scene, 200, rng)):
        loads = corners[i % len(corners)] if i % 3 else rng.dirichlet(np.ones(len(corners))) @ corners
        table = replace(plan.scene.object, support=fp.Support.points(points, loads), uncertainty=None)
        scenes.append(replace(plan.scene, object=table, start=begin))
    rolled = roll(plan, scenes, "exact", "arcs")
    assert set(rolled.outcomes) == {"completed"}
    errors = np.abs([plan.scene.goal_error(pose) for pose in rolled.final])
    assert np.all(errors <= [*(np.array(plan.certificate.set_end) + 1e-6), 1e-6])
    if crowded:
        assert plan.certificate.set_clearance >= 0
        poses = rolled.object.reshape(-1, 3)
        assert np.min(object_distances(plan.scene)(poses)) >= plan.certificate.set_clearance - 1e-6


def test_a_tube_is_kept_clear_of_what_the_plan_itself_would_pass(plan):
    """A wall beside the object where it starts: from elsewhere in the region it is nearer."""
    wall = plan.scene.start_pose[:2] + np.array([[-0.1, 0.05], [0.1, 0.05], [0.1, 0.06], [-0.1, 0.06]])
    near = fp.Workspace(None, [wall])
    scene = replace(plan.scene, workspace=near)
    certificate = certify(scene, plan.segments)
    assert certificate.clearance == pytest.approx(clearance_of(scene, plan.segments))
    rooms = [part.clearance for part in certificate.tube]
    assert certificate.set_clearance == min([certificate.clearance, *rooms])
    assert rooms[0] <= certificate.clearance - 0.002
    assert tube_of(scene, plan.segments)[0].clearance == rooms[0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"pushes": [{"name": "a", "at": [0, -17.5]}, {"name": "b", "at": [0, 17.5]}]},
            r"up to 3 pushes leave .* mm in x",
        ),
        ({"pusher": {"fingers": 2, "spacing": 18}}, r"approach: …} of .* mm more would do"),
        ({"pusher": {"fingers": 2, "spacing": 46, "approach": 4}}, r"from the end of its side"),
    ],
)
def test_where_no_plan_is_found_it_is_said_what_is_missing(change, message):
    document = {
        "flatpush": "scene/1", "units": {"length": "mm", "angle": "deg"},
        "object": {
            "outline": [[25, -17.5], [25, 17.5], [-25, 17.5], [-25, -17.5]], "friction": 0.4,
            "support": {"points": [[-18, -12, 1], [18, -12, 1], [18, 12, 1], [-18, 12, 1]]},
            "uncertainty": {"start": {"position": 2, "angle": 2}},
        },
        "pusher": {"fingers": 2, "spacing": 18, "approach": 4}, "start": [60, 20, 140], "goal": [0, 0, 0],
        "pushes": [{"name": "a", "at": [0, -17.5]}, {"name": "b", "at": [25, 0]}],
    } | change  # fmt: skip
    plan = fp.plan(parse_scene(document))
    assert plan.status == "no_plan"
    assert search(message, plan.reason), plan.reason


def test_in_a_notch_a_finger_keeps_as_far_from_the_other_sides_as_the_object_may_be_off():
    """A finger 4.5 mm from the wall of the notch, less its radius of 2.5 mm, and starts off by 1 or 3 mm."""
    notch = [(-0.016, -0.02), (-0.016, -0.005), (0.016, -0.005), (0.016, -0.02)]
    notched = [(-0.04, -0.02), *notch, (0.04, -0.02), (0.04, 0.02), (-0.04, 0.02)]
    thing = fp.Object(notched, fp.Support.points([(-0.03, 0.01), (0.03, 0.01), (0.0, 0.0)]), friction=0.4)
    push = fp.Push("notch", thing.outline.nearest((0.0, -0.005)), 2, 0.023)
    scene = fp.Scene(thing, (0.1, 0.0, 0.0), pusher=PUSHER, pushes=(push,))
    side = side_of(scene, placement_of(scene, push))
    assert side.beside == pytest.approx(0.002, abs=1e-9)
    left = Landing(0.001, 0.0, 0.0, 0.001)
    check_landing(side, left, 0.001)
    with pytest.raises(
        fp.InputError, match=r"another side of the object at 2.00 mm, which may be off by 3.00 mm"
    ):
        check_landing(side, left, 0.003)
    square = fp.Object(RECTANGLE, friction=0.4)
    push = fp.Push("long", square.outline.nearest((0.0, -0.0175)), 2, 0.018)
    assert (
        side_of(replace(scene, object=square), placement_of(replace(scene, object=square), push)).beside
        == np.inf
    )


def test_a_start_region_that_reaches_something_is_refused_with_the_place(plan):
    wall = [(0.04, 0.049), (0.09, 0.049), (0.09, 0.06), (0.04, 0.06)]
    scene = replace(plan.scene, start=(0.06, 0.03, 0.0), workspace=fp.Workspace(None, [wall]))
    with pytest.raises(fp.InputError, match=r"start region .* obstacle 0") as refused:
        fp.plan(scene)
    assert refused.value.key == "object.uncertainty.start"
    with pytest.raises(fp.InputError, match="leaves the bounds"):
        fp.plan(replace(scene, workspace=fp.Workspace((-0.1, -0.1, 0.086, 0.1))))
    check_endpoints(scene)


@pytest.mark.slow
def test_an_object_that_starts_at_the_goal_is_pushed_if_its_region_is_wider_than_the_tolerance():
    near = (0.0, 0.0, 0.0)
    assert fp.plan(scene_of(fp.StartRegion(0.0004, 0.002), start=near)).segments == ()
    plan = fp.plan(scene_of(start=near))
    assert len(plan.pushes) >= 2
    assert pose_error(plan.final_pose(), plan.scene.goal) == pytest.approx(np.zeros(3), abs=1e-9)
