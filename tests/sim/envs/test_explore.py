import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import sim.envs  # noqa: F401 (registers)
from sim.envs.site import site_of
from sim.errors import SimError
from worlds.errors import WorldError
from worlds.splits import MapName

ID = "bricktwin/Explore-v0"
EASY = MapName("test", "easy", 2).text


def drive(env, steps, seed=0):
    """Observations, rewards and the last info of a drive at random."""
    random, action = np.random.default_rng(seed), env.action_space.sample()
    seen, rewards = [env.reset(seed=seed)[0]], []
    for k in range(steps):
        if k % 12 == 0:
            action = random.uniform((0.2, -0.5), (1.0, 0.5)).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        seen.append(observation)
        rewards.append(reward)
        if terminated or truncated:
            break
    return seen, rewards, info


def assert_same(a, b):
    assert len(a) == len(b)
    for k, (one, other) in enumerate(zip(a, b, strict=True)):
        for name in one:
            np.testing.assert_array_equal(one[name], other[name], err_msg=f"{name} at step {k}")


@pytest.fixture
def env():
    made = gymnasium.make(ID, world=EASY)
    yield made
    made.close()


def test_gymnasium_finds_nothing_wrong(env):
    check_env(env.unwrapped)


@pytest.mark.parametrize("text", [MapName("test", "easy", k).text for k in range(8)])
def test_the_kernel_is_the_robot_to_the_bit(text):
    fast, slow = gymnasium.make(ID, world=text), gymnasium.make(ID, world=text, native=False)
    a, b = drive(fast, 150), drive(slow, 150)
    assert_same(a[0], b[0])
    assert a[1:] == b[1:]
    slow.close()


def test_the_same_seed_gives_the_same_episode(env):
    a, b = drive(env, 60, seed=4), drive(env, 60, seed=4)
    assert_same(a[0], b[0])
    assert a[1:] == b[1:]


def test_a_robot_that_stands_still_sees_what_is_before_it(env):
    observation, info = env.reset(seed=0)
    assert 0.0 < info["coverage"] < 1.0
    assert observation["map"][0, 20:30, 30:34].max() == 255
    np.testing.assert_allclose(observation["pose"], [0.0, 0.0, 1.0, 0.0], atol=1e-6)
    assert observation["time"] == 1.0


def test_reward_is_the_area_newly_seen_less_the_time(env):
    _, start = env.reset(seed=0)
    steps = [env.step(np.array([0.0, 0.3], np.float32)) for _ in range(50)]
    assert sum(step[1] for step in steps) == pytest.approx(steps[-1][4]["area"] - start["area"] - 50 * 0.01)


def test_an_episode_ends_at_the_goal_and_with_the_time():
    quick = gymnasium.make(ID, world=EASY, goal=0.05)
    quick.reset(seed=0)
    assert quick.step(np.zeros(2, np.float32))[2:4] == (True, False)
    short = gymnasium.make(ID, world=EASY, steps=3, max_episode_steps=3)
    short.reset(seed=0)
    ends = [short.step(np.zeros(2, np.float32)) for _ in range(3)]
    assert [end[2:4] for end in ends] == [(False, False), (False, False), (False, True)]
    assert ends[2][0]["time"] == 0.0


def test_driving_into_a_wall_is_a_collision(env):
    env.reset(seed=0)
    for _ in range(250):
        info = env.step(np.array([1.0, 0.0], np.float32))[4]
    assert info["collisions"] == 1
    assert info["path_length"] < 8.0


def test_all_that_counts_can_be_seen():
    site = site_of(EASY)
    assert 0.6 < site.cells * 0.0025 / (7.0 * 6.0) < 1.2


def test_a_seed_draws_the_map():
    env = gymnasium.make(ID, split="validation", difficulty="easy")
    places = []
    for seed in (1, 2, 1):
        env.reset(seed=seed)
        places.append(env.unwrapped.site.text)
    assert places[0] == places[2] != places[1]


def test_the_picture_shows_the_map():
    env = gymnasium.make(ID, world=EASY, render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    for _ in range(20):
        env.step(np.array([0.5, 1.0], np.float32))
    assert first.shape == (776, 720, 3)
    assert first.dtype == np.uint8
    assert (env.render() != first).any()


@pytest.mark.parametrize("pose", ["odometry", "slam"])
def test_the_map_may_be_made_without_the_truth(pose):
    env = gymnasium.make(ID, world=EASY, pose=pose, realism="datasheet")
    _, _, info = drive(env, 40)
    observation = env.step(np.zeros(2, np.float32))[0]
    assert 0.2 < info["coverage"] <= 1.0
    assert (observation["map"] == 255).mean() > 0.2
    env.close()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"robot": "ev4"}, "no robot 'ev4'; available: kinematic, sim, ev3"),
        ({"pose": "gps"}, "no pose 'gps'; available: truth"),
        ({"robot": "ev3"}, "a real robot has no true pose"),
        ({"goal": 2.0}, "the goal is a share"),
        ({"split": "exam"}, "no split 'exam'; available: train"),
        ({"robot": "ev3", "pose": "slam", "world": "hall"}, "a real robot takes no world"),
        ({"realism": "perfect"}, "no realism 'perfect'"),
    ],
)
def test_an_option_that_cannot_be_is_named(options, message):
    with pytest.raises((SimError, WorldError), match=message):
        gymnasium.make(ID, **options)
