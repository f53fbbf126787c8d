import gymnasium
import pytest

import sim.envs  # noqa: F401 (registers)
from worlds.splits import MapName

env_checker = pytest.importorskip("stable_baselines3.common.env_checker", reason="an optional extra")


@pytest.mark.parametrize("name", ["Explore", "ExploreFrontier", "ExploreVision"])
def test_stable_baselines_finds_nothing_wrong(name):
    env = gymnasium.make(f"bricktwin/{name}-v0", world=MapName("test", "easy", 2).text)
    env_checker.check_env(env.unwrapped)
    env.close()
