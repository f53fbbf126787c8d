import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="an optional extra")


def test_the_example_trains_an_agent_that_can_be_scored():
    from scripts.examples import ppo

    model = ppo.train(seconds=1e9, steps=256)
    assert model.num_timesteps == 256
    by_model = ppo.score(lambda seen: np.int64(model.predict(seen, deterministic=True)[0]), episodes=1)
    assert by_model == ppo.score(lambda seen: np.int64(model.predict(seen, deterministic=True)[0]), episodes=1)
