"""Pushes that slide: rolled out once and moved, sequences of them, and the policy that solves Push-T with them."""

import numpy as np
import pytest
from tests.extras import extra

import flatpush as fp
from flatpush.errors import InputError
from flatpush.geometry import Outline, compose, pose_error, transform
from flatpush.geometry.collision import World
from flatpush.geometry.pose import cross
from flatpush.gym import PushTPolicy
from flatpush.gym.push_t import CENTRE_OF_GRAVITY, GOAL, MOMENT, PIXEL, SOLVED, TIP, check_environment, tee
from flatpush.planning.sliding import SlidePlanner, SlideSearch, slide_library
from flatpush.planning.sliding.exact import STEADY, SWITCH
from flatpush.simulation.plant import Plant


def plant_of_tee() -> Plant:
    thing = tee()
    return Plant(thing, [[0.0, 0.0]], TIP, surface=thing.surface, cof=CENTRE_OF_GRAVITY)


@pytest.fixture(scope="module")
def library():
    """A small one: pushes of 2, 10 and 40 mm."""
    return slide_library(tee(), plant_of_tee(), directions=[-0.7, 0.0, 0.7], lengths=[0.002, 0.01, 0.04])


@pytest.fixture(scope="module")
def policy():
    return PushTPolicy()


def test_a_push_holds_at_every_pose(library):
    """Rolled out again elsewhere, each push moves the object as the library says."""
    plant, rng = plant_of_tee(), np.random.default_rng(4)
    for k in rng.choice(len(library), 25, replace=False):
        pose = rng.uniform(-1, 1, 3) * [0.3, 0.3, np.pi]
        tips = transform(pose, np.stack([library.begin[k], library.end[k]]))
        hand = np.column_stack([tips, np.zeros(2)])
        after = plant.follow(pose, hand).object[-1]
        assert np.allclose(pose_error(after, compose(pose, library.displacement[k])), 0, atol=2e-6)


def test_a_short_push_without_friction_is_the_closed_form(library):
    """The force is along the normal n at r: V is A (n, r × n) scaled so that the contact yields to the finger."""
    outline, cof = tee().outline, np.array(CENTRE_OF_GRAVITY)
    checked = 0
    for k in np.flatnonzero(library.length == 0.002):
        contact = outline.at(library.edge[k], library.along[k])
        if 0.2 < library.along[k] < 0.8:
            n, r = contact.normal, contact.point - cof
            arm = r[0] * n[1] - r[1] * n[0]
            per_advance = np.array([*n, arm / MOMENT]) / (1 + arm**2 / MOMENT)
            advance = 0.002 * np.cos(library.direction[k])
            moved = library.coordinates(library.displacement[k])[:2] - cof
            assert np.allclose(moved, advance * per_advance[:2], atol=6e-5)
            assert library.displacement[k, 2] == pytest.approx(advance * per_advance[2], abs=2e-3)
            checked += 1
    assert checked > 50


def test_pushes_begin_clear_of_the_object(library):
    outline = tee().outline
    gaps = [outline.nearest(tip).distance - TIP for tip in library.begin]
    assert min(gaps) > 0


def test_pairs_are_the_nearest_of_all_pairs(library):
    """Against brute force over every pair of pushes."""
    search, rng = SlideSearch(library), np.random.default_rng(1)
    moves = library.displacement
    pairs = compose(moves[:, None], moves[None])
    places = library.coordinates(pairs)
    for _ in range(4):
        first, second = rng.integers(len(library), size=2)
        goal = compose(pairs[first, second], rng.normal(size=3) * [1e-3, 1e-3, 0.01])
        least = np.linalg.norm(places - library.coordinates(goal), axis=-1).min()
        found = next(s for s in search.sequences(goal, 0.02) if len(s.pushes) == 2)
        assert found.miss == pytest.approx(least, abs=1e-12)
        assert np.linalg.norm(places[found.pushes] - library.coordinates(goal)) == pytest.approx(least)


def test_longer_sequences_end_where_they_say(library):
    search = SlideSearch(library)
    goal, lengths = np.array([0.03, 0.06, 1.0]), set()
    for sequence in search.sequences(goal, 0.01):
        pose = np.zeros(3)
        for k in sequence.pushes:
            pose = compose(pose, library.displacement[k])
        miss = np.linalg.norm(library.coordinates(pose) - library.coordinates(goal))
        assert miss == pytest.approx(sequence.miss, abs=1e-12)
        assert miss < 0.01
        lengths.add(len(sequence.pushes))
    assert {3, 4} <= lengths
    near = [s.miss for s in search.approaches([1.0, 0.0, 0.0]) if len(s.pushes) == 2]
    assert near == sorted(near)


def test_fingers_that_no_library_knows_are_refused():
    plant = Plant(tee(), [[0.0, 0.01], [0.0, -0.01]], TIP)
    with pytest.raises(InputError, match="one finger"):
        slide_library(tee(), plant)


def followed(agent, place, velocity, commands):
    """The law written out, substep by substep."""
    places = []
    for command in commands:
        for _ in range(agent.substeps):
            velocity = velocity + agent.dt * (agent.stiffness * (command - place) - agent.damping * velocity)
            place = place + agent.dt * velocity
            places.append(place)
    return np.array(places), velocity


def test_ways_of_the_agent_are_the_law_written_out(policy):
    agent, rng = policy.agent, np.random.default_rng(2)
    for first in range(3):
        place, target = rng.uniform(0.2, 0.3, (2, 2))
        for begun in rng.uniform(0.15, 0.35, (8, first, 2)):
            command = agent.way(place, target, begun)
            written, velocity = followed(agent, place, np.zeros(2), command)
            assert np.array_equal(command[:first], begun)
            places = agent.laws(first)[1] @ (np.concatenate([place[None], begun]) - target) + target
            assert np.allclose(places, written, atol=1e-12)
            assert np.allclose(written[-1], target, atol=1e-12)
            assert np.allclose(velocity, 0, atol=1e-11)
    commands = agent.straight(np.array([0.1, 0.2]), np.array([0.48, 0.5]))
    written, velocity = followed(agent, np.array([0.1, 0.2]), np.zeros(2), commands)
    assert np.allclose([*written[-1], *velocity], [0.48, 0.5, 0, 0], atol=1e-11)
    assert len(commands) > 2  # two would have to command a place beyond the room
    assert np.allclose(cross([0.38, 0.3], written - [0.1, 0.2]), 0, atol=1e-12)


def test_the_way_around_is_the_shortest_clear_one_of_all(policy):
    """Against every candidate followed through the law, its gaps measured by shapely."""
    from shapely import Polygon, points

    from flatpush.gym.kernels import shortest_clear
    from flatpush.gym.push_t import BOXES

    agent, rng = policy.agent, np.random.default_rng(5)
    pose, place, target = np.array([0.25, 0.25, 2.0]), np.array([0.12, 0.3]), np.array([0.4, 0.22])
    begun = rng.uniform(0.0, 0.512, (400, 2, 2))
    obstacle, lengths = Polygon(transform(pose, tee().outline.vertices)), []
    for first in begun:
        commands = agent.way(place, target, first)
        way, _ = followed(agent, place, np.zeros(2), commands)
        clear = obstacle.distance(points(way)).min() >= TIP + 0.001
        clear &= bool(np.all((commands >= 0) & (commands <= 0.512)))
        lengths.append(np.linalg.norm(np.diff(way, axis=0), axis=1).sum() if clear else np.inf)
    found = shortest_clear(*agent.laws(2), place, target, begun, 0.512, pose, BOXES, TIP + 0.001)
    assert 5 < np.isfinite(lengths).sum() < 300
    assert found == np.argmin(lengths)
    far = np.full(2, 0.9)  # no commands within the room lead there and rest
    assert shortest_clear(*agent.laws(2), place, far, begun, 0.512, pose, BOXES, TIP) == -1


def covered(pose) -> float:
    from shapely import Polygon

    corners = tee().outline.vertices
    target, here = Polygon(transform(GOAL, corners)), Polygon(transform(pose, corners))
    return target.intersection(here).area / target.area


@pytest.mark.parametrize("seed", range(4))
def test_the_policy_solves_starts_in_the_plant(policy, seed):
    """The plant as the environment: commands are followed by the agent's law, the T by quasi-static mechanics."""
    plant, rng = plant_of_tee(), np.random.default_rng(seed)
    pose = np.array([*rng.uniform(0.2, 0.35, 2), rng.uniform(-np.pi, np.pi)])
    place, velocity = np.array([0.06, 0.06]), np.zeros(2)
    policy.reset()
    for _ in range(60):
        seen = [*place / PIXEL, *pose[:2] / PIXEL, pose[2]]
        way, velocity = followed(policy.agent, place, velocity, policy.act(seen)[None] * PIXEL)
        hand = np.column_stack([np.vstack([place, way]), np.zeros(len(way) + 1)])
        pose, place = plant.follow(pose, hand).object[-1], way[-1]
        if covered(pose) > SOLVED:
            break
    assert covered(pose) > SOLVED


def test_the_policy_refuses_other_observations_and_environments(policy):
    for wrong in ([1.0, 2.0], np.zeros((96, 96, 3)), [np.nan] * 5):
        with pytest.raises(InputError, match="observation"):
            policy.act(wrong)

    class Other:
        obs_type = "pixels"

        @property
        def unwrapped(self):
            return self

    with pytest.raises(InputError, match="obs_type"):
        check_environment(Other())


@pytest.mark.slow
def test_push_t_is_solved_in_its_own_environment():
    pytest.importorskip("gym_pusht", reason=extra("gym"))
    from flatpush.experiments.push_t import run

    assert "solved 10 of 10" in run(seeds=(100000, 100010))


def test_ranges_of_seeds_are_two_numbers():
    from flatpush.experiments import experiment

    for wrong in ("5", "9:3", "a:b", "-1:3"):
        with pytest.raises(InputError, match="FIRST:END"):
            experiment("push-t", seeds=wrong)
    with pytest.raises(InputError, match="no range of seeds"):
        experiment("fig4", seeds="0:3")


def test_a_finger_wider_than_every_gap_still_finds_the_outside():
    thing = fp.Object(tee().outline.vertices, friction=0.0)
    library = slide_library(thing, Plant(thing, [[0.0, 0.0]], 0.2), directions=[0.0], lengths=[0.01])
    assert 0 < len(library) < 60


def slippery(name: str) -> fp.Object:
    if name == "disc":
        support = fp.Support.points([[0.008, 0.0], [0.02, 0.015], [0.02, -0.015]], [1.0, 1.0, 1.0])
        return fp.Object(Outline.circle(0.03), support, friction=0.0)
    surface = fp.Ellipsoid(np.diag([1.0, 1.0, 2000.0]))
    return fp.Object(
        [(-0.03, -0.02), (0.03, -0.02), (0.03, 0.02), (-0.03, 0.02)], friction=0.0, surface=surface
    )


@pytest.fixture(scope="module")
def planner():
    return SlidePlanner(Plant(slippery("rectangle"), [[0.0, 0.0]], 0.0025))


def rolled_out(plant: Plant, pose, pushes):
    """The whole plan from its start, each push as one straight way."""
    for push in pushes:
        pose = plant.follow(pose, np.column_stack([push.tip[[0, -1]], np.zeros(2)]), push_out=False).object[
            -1
        ]
    return pose


@pytest.mark.parametrize("start", [[0.02, 0.01, 0.5], [-0.13, 0.06, 2.5]])
def test_plans_of_slides_end_at_the_goal_in_the_plant(planner, start):
    """Against a rollout of the whole plan, every push from where the one before left the object."""
    plan = planner.plan(start, np.zeros(3))
    assert plan.status == "solved"
    end = rolled_out(planner.plant, np.array(start), plan.pushes)
    assert np.allclose(pose_error(end, np.zeros(3)), 0, atol=[2e-4, 2e-4, 3e-3])
    lengths = [np.linalg.norm(push.tip[-1] - push.tip[0]) for push in plan.pushes]
    assert plan.cost == pytest.approx(sum(lengths) + SWITCH * (len(lengths) - 1), abs=2e-3 * len(lengths))
    again = planner.plan(start, np.zeros(3))
    assert [p.length for p in again.pushes] == [p.length for p in plan.pushes]


def test_each_plan_is_cheaper_than_the_one_before(planner):
    costs = [plan.cost for plan in planner.plans([0.02, 0.01, 0.5], np.zeros(3))]
    assert len(costs) >= 2
    assert costs == sorted(costs, reverse=True)


def test_growth_is_what_a_push_beside_its_way_does(planner):
    slides, rng = planner.slides, np.random.default_rng(3)
    for k in rng.choice(len(slides), 8, replace=False):
        way = np.stack([slides.begin[k], slides.end[k]])
        aside = np.array([way[0, 1] - way[1, 1], way[1, 0] - way[0, 0]])
        aside *= 1e-4 / np.linalg.norm(aside)
        moved = [
            planner.plant.follow(np.zeros(3), np.column_stack([way + s * aside, np.zeros(2)])).object[-1]
            for s in (0, 1)
        ]
        off = np.linalg.norm(slides.coordinates(moved[1]) - slides.coordinates(moved[0]))
        assert slides.growth[k] == pytest.approx(off / 1e-4, abs=0.15)
    assert slides.growth.max() <= STEADY


def test_slides_keep_clear_of_obstacles_and_bounds():
    """On the table: shapely measures object and fingertip at every sample, and the ways around."""
    from shapely import LineString, Polygon

    thing, start = slippery("rectangle"), np.array([0.06, 0.01, 0.4])
    post = Outline.polygon([(0.025, 0.04), (0.035, 0.04), (0.035, 0.05), (0.025, 0.05)])
    world = World.of((-0.06, -0.08, 0.14, 0.08), [post])
    plant = Plant(thing, [[0.0, 0.0]], 0.0025)
    plan = SlidePlanner(plant, world, clearance=0.001, planar=True).plan(start, np.zeros(3), tip=[0.1, 0.05])
    assert plan.status == "solved"
    obstacle, pose, left = Polygon(post.vertices), start, [0.1, 0.05]
    for push in plan.pushes:
        assert np.allclose(push.way[[0, -1]], [left, push.tip[0]], atol=1e-9)
        around = LineString(push.way[1:-1])
        assert Polygon(transform(pose, thing.outline.vertices)).distance(around) > 0.0025
        assert obstacle.distance(around) >= 0.0035 - 1e-9
        left = push.tip[-1]
        for tip, pose in zip(push.tip, push.object, strict=True):
            corners = transform(pose, thing.outline.vertices)
            assert obstacle.distance(Polygon(corners)) >= 0.001 - 1e-9
            for points, gap in ((corners, 0.001), (tip[None], 0.0035)):
                assert np.all(points.min(axis=0) >= np.array([-0.06, -0.08]) + gap - 1e-9)
                assert np.all(points.max(axis=0) <= np.array([0.14, 0.08]) - gap + 1e-9)
    assert np.allclose(pose_error(plan.end, np.zeros(3)), 0, atol=3e-4)


def test_a_disc_that_no_push_turns_is_refused():
    """Pushed through its centre it never turns; asked for the heading it has, it is pushed."""
    surface = fp.Ellipsoid(np.diag([1.0, 1.0, 2000.0]))
    disc = fp.Object(Outline.circle(0.03), friction=0.0, surface=surface)
    planner = SlidePlanner(Plant(disc, [[0.0, 0.0]], 0.0025))
    refused = planner.plan([0.05, 0.0, 0.3], np.zeros(3))
    assert refused.status == "no_plan"
    assert "turns" in refused.reason
    plan = planner.plan([0.05, 0.02, 0.3], [0.0, 0.0, 0.3])
    assert plan.status == "solved"
    end = rolled_out(planner.plant, np.array([0.05, 0.02, 0.3]), plan.pushes)
    assert np.allclose(end, [0.0, 0.0, 0.3], atol=1e-4)


@pytest.mark.slow
def test_a_disc_off_its_centre_is_turned_and_moved():
    planner, start = SlidePlanner(Plant(slippery("disc"), [[0.0, 0.0]], 0.0025)), np.array([-0.06, 0.1, -1.2])
    plan = planner.plan(start, np.zeros(3))
    end = rolled_out(planner.plant, start, plan.pushes)
    assert np.allclose(pose_error(end, np.zeros(3)), 0, atol=[2e-4, 2e-4, 5e-3])
