import numpy as np
import pytest

from sim.envs.explore import ExploreEnv
from sim.envs.explorers import EXPLORERS, FrontierExplorer
from worlds.splits import MapName

EASY = MapName("test", "easy", 7).text


@pytest.mark.parametrize("name", EXPLORERS)
def test_an_explorer_sees_more_than_a_robot_that_stands(name):
    env = ExploreEnv(world=EASY)
    env.reset(seed=0)
    start = env.tally.coverage
    explorer = EXPLORERS[name](env, np.random.default_rng(0))
    while env.tally.steps < 1200 and not env.is_done and explorer.act():
        pass
    assert env.tally.coverage > start + 0.02
    if isinstance(explorer, FrontierExplorer):
        assert env.tally.collisions == 0
        assert env.tally.coverage > 0.98
