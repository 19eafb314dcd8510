"""flatpush/Push-v0: Gymnasium's checker, the plant behind it, many at once, success, pictures, noise, the baseline."""

import pickle
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from shapely import Point
from tests.extras import extra

import flatpush as fp
from flatpush.errors import InputError
from flatpush.geometry import Outline, transform
from flatpush.gym import Eyes, PushPolicy, PushTask, register
from flatpush.simulation.plant import Plant

gymnasium = pytest.importorskip("gymnasium", reason=extra("gym"))

BRICK = [(-0.03, -0.02), (0.03, -0.02), (0.03, 0.02), (-0.03, 0.02)]


def scene(friction=0.3, **changes) -> fp.Scene:
    return replace(fp.Scene(fp.Object(BRICK, friction=friction), (0.08, 0.02, 0.5)), **changes)


def made(asked=None, **options):
    register()
    return gymnasium.make(
        "flatpush/Push-v0", scene=asked or scene(), disable_env_checker=True, **options
    ).unwrapped


@pytest.mark.parametrize("observation", ["state", "image"])
def test_it_passes_the_checker(observation):
    from gymnasium.utils.env_checker import check_env

    env = made(observation=observation, render_mode="rgb_array")
    check_env(env)
    assert env.observation_space.contains(env.reset(seed=0)[0])


def test_the_same_seed_is_the_same_episode_and_others_differ():
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (20, 2))

    def run(seed):
        env = made(noise=fp.Noise(), eyes=Eyes(1e-3, 0.02, 1, 0.2))
        seen = [env.reset(seed=seed)[0]] + [env.step(a)[0] for a in actions]
        return np.array(seen)

    first = run(3)
    assert np.array_equal(first, run(3))
    assert not np.allclose(first, run(4), atol=1e-3)


@pytest.mark.parametrize("twin", [deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_an_environment_in_use_can_be_copied_and_sent(twin):
    """It goes on as the first; noise and late frames included. After steps pickle refused it."""
    one = made(noise=fp.Noise(), eyes=Eyes(1e-3, 0.02, 1, 0.2))
    one.reset(seed=2, options={"start": [0, 0, 0], "hand": [0.0, -0.025, 0.0]})
    for _ in range(5):
        one.step([0.0, 1.0])
    other = twin(one)
    seen = [[env.step([0.2, 1.0])[0] for _ in range(5)] for env in (one, other)]
    assert np.array_equal(*seen)
    assert not np.array_equal(seen[0][0], seen[0][-1])


def test_a_decision_is_what_the_plant_does():
    """The finger goes straight at the pusher's speed for a tenth of a second: once by the plant alone."""
    env, plant = made(), Plant(scene().object, [[0.0, 0.0]], 0.0025)
    start, hand = np.array([0.01, 0.02, 0.3]), np.array([0.01, -0.04, 1.0])
    env.reset(options={"start": start, "goal": [0, 0, 0], "hand": hand})
    way, pose = [hand], start
    for _ in range(40):
        action = np.array([0.2, 0.9])
        state, *_, info = env.step(action)
        way.append(way[-1] + np.append(action * 0.02 * 0.1, 0.0))
    pose = plant.follow(start, np.array(way)).object[-1]
    assert np.hypot(*(pose - start)[:2]) > 0.01
    assert np.allclose(info["pose"], pose, atol=1e-5)
    assert np.allclose(state[:2], pose[:2], atol=1e-5)
    assert np.allclose(state[2:4], [np.sin(pose[2]), np.cos(pose[2])], atol=1e-4)


def test_many_are_as_one():
    """Every one of a vector, through the ends of episodes, is as it would be alone."""
    register()
    asked, count, steps = scene(), 3, 12
    actions = np.random.default_rng(1).uniform(-1, 1, (steps, count, 2))
    many = gymnasium.make_vec("flatpush/Push-v0", count, scene=asked, longest=5)
    alone = [made(asked, longest=5) for _ in range(count)]
    seen, _ = many.reset(seed=7)
    own = [env.reset(seed=7 + k)[0] for k, env in enumerate(alone)]
    assert np.allclose(seen, own)
    over = [False] * count
    for step in range(steps):
        seen, rewards, _, cut, _ = many.step(actions[step])
        for k, env in enumerate(alone):
            if over[k]:
                state, reward, ended, short = env.reset()[0], 0.0, False, False
            else:
                state, reward, ended, short, _ = env.step(actions[step, k])
            over[k] = ended or short
            assert np.allclose(seen[k], state, atol=1e-6)
            assert rewards[k] == pytest.approx(reward, abs=1e-9)
            assert cut[k] == short
    assert step > 10


def test_success_by_pose_and_by_coverage():
    """Coverage against counted points of a grid."""
    task = PushTask(scene(), success="coverage", coverage=0.8)
    goal, pose = np.zeros(3), np.array([0.008, 0.003, 0.2])
    points = np.random.default_rng(2).uniform([-0.03, -0.02], [0.03, 0.02], (40000, 2))
    c, s = np.cos(pose[2]), np.sin(pose[2])
    seen = (points - pose[:2]) @ np.array([[c, -s], [s, c]])
    share = np.mean(np.all(np.abs(seen) <= [0.03, 0.02], axis=1))
    assert task.covered(pose, goal) == pytest.approx(share, abs=0.01)
    assert task.solved(pose, goal) == (share >= 0.8)
    strict = PushTask(scene())
    assert strict.solved(np.array([4e-4, -4e-4, 2 * np.pi + 0.008]), goal)
    assert not strict.solved(np.array([6e-4, 0.0, 0.0]), goal)
    assert not strict.solved(np.array([0.0, 0.0, 0.01]), goal)


def test_the_reward_adds_up_to_how_much_nearer_it_came():
    env = made()
    env.reset(options={"start": [0.0, 0.03, 0.0], "goal": [0, 0, 0], "hand": [0.005, 0.07, 0.0]})
    total = sum(env.step(np.array([0.0, -1.0]))[1] for _ in range(12))
    end = env.step(np.zeros(2))[4]["pose"]
    corners = np.array(BRICK)
    far = np.max(np.linalg.norm(transform(end, corners) - corners, axis=1))
    assert total == pytest.approx((0.03 - far) / scene().object.outline.size, abs=1e-6)
    assert total > 0


def test_the_picture_shows_where_things_are():
    env = made(observation="image")
    picture, _ = env.reset(
        options={"start": [0.05, 0.06, 0.0], "goal": [-0.07, 0, 0], "hand": [-0.1, -0.1, 0.0]}
    )
    low, high = env.task.box
    size = float(high[0] - low[0])

    def colour(x, y):
        return picture[int((high[1] - y) / size * 96), int((x - low[0]) / size * 96)]

    assert picture.shape == (96, 96, 3)
    assert tuple(colour(0.05, 0.06)) == (0x5B, 0x7A, 0x99)
    assert tuple(colour(-0.07, 0.0)) == (0x8F, 0xD6, 0x94)
    assert tuple(colour(0.0, -0.1)) == (255, 255, 255)
    assert colour(-0.1, -0.1)[2] > 150 > colour(-0.1, -0.1)[0]


def test_frames_come_late():
    late, sharp = made(eyes=Eyes(late=2)), made()
    options = {"start": [0.0, 0.0, 0.0], "goal": [0.1, 0, 0], "hand": [0.0, -0.03, 0.0]}
    for env in (late, sharp):
        env.reset(options=options)
    true, seen = [], []
    for _ in range(12):
        seen.append(late.step(np.array([0.0, 1.0]))[0][:4])
        true.append(sharp.step(np.array([0.0, 1.0]))[0][:4])
    assert np.allclose(seen[2:], true[:-2], atol=1e-6)
    assert true[-1][1] > 0.005


def test_an_obstacle_ends_it():
    post = [(-0.01, 0.03), (0.01, 0.03), (0.01, 0.05), (-0.01, 0.05)]
    env = made(scene(workspace=fp.Workspace((-0.2, -0.2, 0.2, 0.2), (post,))))
    env.reset(options={"start": [0.0, 0.0, 0.0], "goal": [0.1, 0, 0], "hand": [0.0, -0.03, 0.0]})
    for _ in range(20):
        _, _, ended, _, info = env.step(np.array([0.0, 1.0]))
        if ended:
            break
    assert info["collision"]
    assert not info["is_success"]
    assert info["pose"][1] == pytest.approx(0.01, abs=0.003)


def test_starts_and_goals_are_free():
    post = Outline.circle(0.04, (0.05, 0.05))
    task = PushTask(scene(workspace=fp.Workspace((-0.15, -0.15, 0.15, 0.15), (post,))))
    for seed in range(20):
        drawn, hand = task.drawn(np.random.default_rng(seed))
        for pose in (drawn.start_pose, drawn.goal_pose):
            corners = transform(pose, np.array(BRICK))
            assert np.all(np.abs(corners) <= 0.15)
            assert np.min(np.linalg.norm(corners - [0.05, 0.05], axis=1)) > 0.04
        assert task.shape(drawn.start_pose).distance(Point(hand[:2])) > 0.0025


@pytest.mark.slow
def test_our_planner_solves_it():
    """Also where the finger's friction is not what it believes."""
    env = made(scene(friction=0.05), noise=fp.Noise(0.0, 0.0, 0.3), longest=900)
    policy = PushPolicy(env.task)
    for seed in range(3):
        state, _ = env.reset(seed=seed)
        policy.reset()
        ended = cut = False
        while not (ended or cut):
            state, _, ended, cut, info = env.step(policy.act(state))
        assert info["is_success"], seed


def test_what_cannot_be_is_told():
    with pytest.raises(InputError, match="options of"):
        made(speed=3)
    with pytest.raises(InputError, match="state or image"):
        made(observation="pixels")
    with pytest.raises(InputError, match="goal with an angle"):
        PushTask(scene(goal=(0, 0, "free")))
    with pytest.raises(InputError, match="one finger"):
        PushPolicy(PushTask(scene(pusher=fp.Pusher(fingers=2, spacing=0.018))))
    policy = PushPolicy(PushTask(scene()))
    for state in (
        np.zeros(5),
        np.zeros((96, 96, 3)),
        np.full(10, np.nan),
    ):  # these ended in numpy's own words
        with pytest.raises(InputError, match="a state is 10 finite numbers"):
            policy.act(state)
    with pytest.raises(InputError, match="no room"):
        PushTask(scene(workspace=fp.Workspace((0, 0, 0.01, 0.01)))).drawn(np.random.default_rng(0))
    with pytest.raises(InputError, match="start, goal and hand"):
        made().reset(options={"begin": 1})


def test_wrong_actions_seeds_and_options_are_told_and_move_nothing():
    """One number was taken for both of a velocity, an int64 for no seed, and a knock put NaN in the state."""
    import gymnasium

    env = made()
    before, _ = env.reset(seed=1)
    for action in ([0.1], [0.1, 0.2, 0.3], 0.5, [np.nan, 0.0], "ab", []):
        with pytest.raises(InputError, match="actions are finite numbers"):
            env.step(action)
    with pytest.raises(InputError, match="displacement"):
        env.displace(np.array([np.nan, 0.0, 0.0]))
    with pytest.raises(InputError, match="start"):
        env.reset(options={"start": "here"})
    assert np.array_equal(env.reset(seed=1)[0], before)
    many = gymnasium.make_vec("flatpush/Push-v0", 2, scene=scene())
    assert np.array_equal(many.reset(seed=np.int64(4))[0], many.reset(seed=4)[0])
    with pytest.raises(InputError, match="one seed for each of 2"):
        many.reset(seed=[1])
    with pytest.raises(InputError, match="for each of 2"):
        many.step(np.zeros((2, 1)))
    for option in ({"noise": 3}, {"eyes": 3}, {"substeps": 1.5}, {"longest": 2.5}, {"coverage": "all"}):
        with pytest.raises(InputError, match=next(iter(option))):
            made(**option)
