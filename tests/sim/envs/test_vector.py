import gymnasium
import numpy as np
import pytest

import sim.envs  # noqa: F401 (registers)
from sim.errors import SimError

ID = "bricktwin/Explore-v0"
OPTIONS = {"split": "test", "difficulty": "easy", "max_episode_steps": 25, "steps": 25}
STEPS, COUNT = 32, 8


def rollout(envs):
    """Everything that comes back, as one list of arrays: episodes are cut off and begin anew."""
    actions = np.random.default_rng(3).uniform(-1.0, 1.0, (STEPS, COUNT, 2)).astype(np.float32)
    observation, _ = envs.reset(seed=11)
    seen = [observation[key] for key in sorted(observation)]
    for action in actions:
        observation, *results, info = envs.step(action)
        seen += [*(observation[key] for key in sorted(observation)), *results, info["coverage"]]
    envs.close()
    return seen


def assert_same(a, b):
    assert len(a) == len(b)
    for one, other in zip(a, b, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.fixture(scope="module")
def alone():
    return rollout(gymnasium.make_vec(ID, COUNT, vectorization_mode="sync", **OPTIONS))


@pytest.mark.parametrize("threads", [1, 3])
def test_robots_in_one_kernel_are_the_same_as_alone(alone, threads):
    assert_same(alone, rollout(gymnasium.make_vec(ID, COUNT, threads=threads, **OPTIONS)))


def test_processes_are_the_same_as_one(alone):
    assert_same(alone, rollout(gymnasium.make_vec(ID, COUNT, vectorization_mode="async", vector_kwargs={"context": "spawn"}, **OPTIONS)))


def test_what_the_kernel_does_not_do_is_refused():
    with pytest.raises(SimError, match="take vectorization_mode='sync'"):
        gymnasium.make_vec(ID, 2, pose="odometry")
    with pytest.raises(SimError, match="1 environment or more"):
        gymnasium.make_vec(ID, 0)
