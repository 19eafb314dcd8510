"""Pushes that slide: rolled out once and moved, sequences of them, and the policy that solves Push-T with them."""

import numpy as np
import pytest

import flatpush as fp
from flatpush.errors import InputError
from flatpush.geometry import compose, pose_error, transform
from flatpush.geometry.pose import cross
from flatpush.gym import PushTPolicy
from flatpush.gym.push_t import CENTRE_OF_GRAVITY, GOAL, MOMENT, PIXEL, SOLVED, TIP, check_environment, tee
from flatpush.planning.sliding import SlideSearch, slide_library
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
    pytest.importorskip("gym_pusht", reason="gym-pusht is not installed: pip install 'flatpush[gym]'")
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
