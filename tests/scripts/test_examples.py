import pytest

pytest.importorskip("sb3_contrib", reason="an optional extra")


def test_the_example_trains_an_agent_that_chooses_better_than_chance():
    from scripts.examples import ppo

    model = ppo.train(1024)
    assert model.num_timesteps == 1024
    learnt = ppo.score(ppo.learnt_by(model), 8)
    assert (learnt == ppo.score(ppo.learnt_by(model), 8)).all()
    assert learnt.mean() > ppo.score(ppo.at_random(), 8).mean()
