import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.kernels.particle_weights import mean_likelihood, normalised


@given(st.lists(st.floats(-600.0, 600.0), min_size=1, max_size=1300))
def test_weights_are_those_of_their_logarithms(log_weights):
    log_weights = np.array(log_weights)
    weights, effective = normalised(log_weights)
    expected = np.exp(log_weights - log_weights.max())
    expected /= expected.sum()
    assert weights == pytest.approx(expected, rel=1e-12, abs=1e-290)
    assert effective == pytest.approx(1.0 / np.sum(expected**2), rel=1e-12)


def test_a_likelihood_of_nothing_weighs_nothing():
    weights, effective = normalised(np.array([-np.inf, 0.0, -1e9]))
    assert weights == pytest.approx([0.0, 1.0, 0.0], abs=1e-300)
    assert effective == pytest.approx(1.0)


def test_the_mean_likelihood_is_that_of_a_share_of_the_logarithms():
    rng = np.random.default_rng(1)
    weights, logs = rng.random(777), rng.normal(-80.0, 30.0, 777)
    assert mean_likelihood(weights, logs, 1.0 / 60.0) == pytest.approx(np.sum(weights * np.exp(logs / 60.0)), rel=1e-12)
