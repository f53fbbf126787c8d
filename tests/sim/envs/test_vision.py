import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env

import sim.envs  # noqa: F401 (registers)
from worlds.splits import MapName


def test_the_image_shows_what_is_before_the_robot():
    env = gymnasium.make("bricktwin/ExploreVision-v0", world=MapName("test", "easy", 2).text)
    env.reset(seed=0)
    for _ in range(3):
        observation = env.step(np.array([0.0, 0.3], np.float32))[0]
    assert env.observation_space.contains(observation)
    assert observation["image"].shape == (3, 84, 84)
    assert observation["image"].std() > 5.0
    env.close()


def test_gymnasium_finds_nothing_wrong():
    env = gymnasium.make("bricktwin/ExploreVision-v0", world=MapName("test", "easy", 2).text)
    check_env(env.unwrapped)
    env.close()
