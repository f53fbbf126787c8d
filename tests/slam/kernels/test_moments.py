import math

import numpy as np

from slam.kernels.moments import moments


def test_moments_are_those_of_each_label():
    rng = np.random.default_rng(2)
    poses, weights, labels = rng.normal(0.0, 0.3, (500, 3)), rng.random(500), rng.integers(0, 2, 500)
    shares, means, covariances = moments(poses, weights, labels, 2)
    for k in (0, 1):
        chosen, w = poses[labels == k], weights[labels == k]
        np.testing.assert_allclose(shares[k], w.sum())
        np.testing.assert_allclose(means[k], np.average(chosen, axis=0, weights=w))
        np.testing.assert_allclose(covariances[k], np.cov(chosen.T, aweights=w, bias=True), atol=1e-12)


def test_headings_across_half_a_turn_are_averaged_the_short_way():
    poses = np.array([[0.0, 0.0, math.pi - 0.1], [0.0, 0.0, -math.pi + 0.3]])
    _, means, covariances = moments(poses, np.ones(2), np.zeros(2, np.int64), 1)
    assert abs(math.remainder(means[0, 2] - (math.pi + 0.1), math.tau)) < 1e-12
    assert abs(covariances[0, 2, 2] - 0.04) < 1e-12
