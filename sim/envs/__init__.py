"""Environments of Gymnasium for robots that explore; importing this registers them."""

from __future__ import annotations

import gymnasium

gymnasium.register("bricktwin/Explore-v0", "sim.envs.explore:ExploreEnv", max_episode_steps=3000)
