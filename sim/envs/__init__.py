"""Environments of Gymnasium for robots that explore; importing this registers them."""

from __future__ import annotations

import gymnasium

gymnasium.register(
    "bricktwin/Explore-v0", "sim.envs.explore:ExploreEnv", max_episode_steps=3000, vector_entry_point="sim.envs.vector:ExploreVectorEnv"
)
gymnasium.register("bricktwin/ExploreFrontier-v0", "sim.envs.frontier:ExploreFrontierEnv", max_episode_steps=300)
gymnasium.register("bricktwin/ExploreVision-v0", "sim.envs.vision:ExploreVisionEnv", max_episode_steps=3000)
