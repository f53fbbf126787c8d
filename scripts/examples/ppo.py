"""Let PPO learn for a minute which frontier to go to next, and compare it with choosing at random: python -m scripts.examples.ppo."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import torch
from sb3_contrib import MaskablePPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import SubprocVecEnv
from torch import nn

Seen = dict[str, Any]


def make(split: str = "train") -> gymnasium.Env[Seen, np.int64]:
    """Easy maps, and time for a few choices only."""
    return gymnasium.make("sim.envs:bricktwin/ExploreFrontier-v0", split=split, difficulty="easy", max_episode_steps=25, steps=25)


class Scores(BaseFeaturesExtractor):
    """One network says of every frontier (16) how much it is worth, from the five numbers that are known of it."""

    def __init__(self, space: gymnasium.Space[Any]) -> None:
        super().__init__(space, 16)
        self.score = nn.Sequential(nn.Linear(5, 32), nn.Tanh(), nn.Linear(32, 32), nn.Tanh(), nn.Linear(32, 1))

    def forward(self, seen: Seen) -> torch.Tensor:
        """Worth (N, 16) of N times 16 frontiers: what is counted in metres in tens of them."""
        return self.score(seen["frontiers"].reshape(-1, 16, 5) * torch.tensor([0.1, 1, 1, 0.1, 0.1]))[..., 0]


def train(steps: int = 2048, seed: int = 0) -> MaskablePPO:
    """Learn from so many choices."""
    kinds: dict[str, Any] = {"features_extractor_class": Scores, "share_features_extractor": False, "net_arch": []}
    envs = make_vec_env(make, 2, seed=seed, vec_env_cls=SubprocVecEnv)
    model = MaskablePPO("MultiInputPolicy", envs, n_steps=128, learning_rate=3e-3, gamma=0.9, seed=seed, policy_kwargs=kinds)
    model.policy.action_net = nn.Identity()  # the scores are the logits
    return model.learn(steps)


def score(choose: Callable[[Seen], np.int64], episodes: int = 20) -> np.ndarray:
    """Returns (episodes,) on test maps."""
    env, returns = make("test"), np.zeros(episodes)
    for seed in range(episodes):
        (seen, _), over = env.reset(seed=seed), False
        while not over:
            seen, reward, done, cut, _ = env.step(choose(seen))
            returns[seed], over = returns[seed] + float(reward), done or cut
    return returns


def learnt_by(model: MaskablePPO) -> Callable[[Seen], np.int64]:
    """Chooses what the model thinks best."""
    return lambda seen: np.int64(model.predict(seen, deterministic=True, action_masks=seen["action_mask"])[0])


def at_random(seed: int = 0) -> Callable[[Seen], np.int64]:
    """Chooses any frontier."""
    rng = np.random.default_rng(seed)
    return lambda seen: rng.choice(np.flatnonzero(seen["action_mask"]))


if __name__ == "__main__":
    model = train()
    learnt, guessed = score(learnt_by(model)), score(at_random())
    better = learnt - guessed
    print(f"PPO, {model.num_timesteps} choices: {learnt.mean():.2f}; at random: {guessed.mean():.2f}")
    print(f"better by {better.mean():.2f} ± {better.std() / np.sqrt(len(better)):.2f}, on {(better > 0).sum()} of {len(better)} maps")
