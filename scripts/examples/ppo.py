"""Let PPO learn for a minute which frontier to go to next, and compare it with choosing at random: python -m scripts.examples.ppo."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium.wrappers import FilterObservation
from stable_baselines3 import PPO

Observation = dict[str, Any]


def make(split: str) -> gymnasium.Env[Observation, np.int64]:
    """Easy maps, and time for a few choices only."""
    env = gymnasium.make("sim.envs:bricktwin/ExploreFrontier-v0", split=split, difficulty="easy", max_episode_steps=25, steps=25)
    return FilterObservation(env, ["frontiers", "action_mask"])


def train(seconds: float = 60.0, steps: int = 1_000_000) -> PPO:
    """Learn for a time that the processor is busy [s], or for so many choices."""
    end = time.process_time() + seconds
    model = PPO("MultiInputPolicy", make("train"), n_steps=128, learning_rate=1e-3, gamma=0.9, seed=0)
    return model.learn(steps, callback=lambda *_: time.process_time() < end)


def score(choose: Callable[[Observation], np.int64], episodes: int = 20) -> float:
    """Mean return on test maps."""
    env, total = make("test"), 0.0
    for seed in range(episodes):
        (observation, _), over = env.reset(seed=seed), False
        while not over:
            observation, reward, done, cut, _ = env.step(choose(observation))
            total, over = total + float(reward), done or cut
    return total / episodes


if __name__ == "__main__":
    model, random = train(), np.random.default_rng(0)
    print(f"PPO, {model.num_timesteps} choices: {score(lambda seen: np.int64(model.predict(seen, deterministic=True)[0])):.2f}")
    print(f"at random: {score(lambda seen: random.choice(np.flatnonzero(seen['action_mask']))):.2f}")
