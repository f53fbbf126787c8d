"""What particles weigh, from the logarithms: short loops without a branch, so that the compiler takes several particles at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import inlined, njit

BLOCK = 512
"""Particles that are taken together: the steps between stay in the first cache."""
PER_LOG_2, LOG_2_HIGH, LOG_2_LOW = 1.4426950408889634, 0.693147180369123816490, 1.90821492927058770002e-10
"""One over the logarithm of 2, and it in two parts: a small whole number of times the first is exact."""
LEAST = -700.0
"""Logarithm below which all weigh as good as nothing."""
BIAS, MANTISSA = np.int64(1023), np.int64(52)
"""Of the bits of a number in double precision."""


@njit
def normalised(log_weights: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Weights (N,) whose sum is 1, and N_eff = 1 / sum w^2 (Doucet, Godsill, Andrieu 2000), from logarithms (N,)."""
    weights, most = np.empty(len(log_weights)), log_weights[0]
    for n in range(len(log_weights)):
        most = log_weights[n] if log_weights[n] > most else most
    _exponentials(log_weights, most, 1.0, weights)
    scale = 1.0 / weights.sum()
    for n in range(len(weights)):
        weights[n] *= scale
    return weights, 1.0 / _sum_of_products(weights, weights)


@njit
def mean_likelihood(weights: NDArray[np.float64], log_likelihoods: NDArray[np.float64], share: float) -> float:
    """Mean by weights (N,) of the exponentials of this share of logarithms (N,)."""
    likelihoods = np.empty(len(weights))
    _exponentials(log_likelihoods, 0.0, share, likelihoods)
    return _sum_of_products(likelihoods, weights)


@njit
def _exponentials(logs: NDArray[np.float64], most: float, share: float, found: NDArray[np.float64]) -> None:
    """Write exp(share (x - most)) for every x (N,), right to 1e-15 of it; beyond exp(-700) and exp(700) all are the same."""
    scales, doublings, rests = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    bits = scales.view(np.int64)
    for start in range(0, len(logs), BLOCK):
        some, result = logs[start : start + BLOCK], found[start : start + BLOCK]
        for n in range(len(some)):
            x = share * (some[n] - most)
            x = LEAST if x < LEAST else x
            x = -LEAST if x > -LEAST else x
            doublings[n] = np.floor(x * PER_LOG_2 + 0.5)
            rests[n] = x - doublings[n] * LOG_2_HIGH - doublings[n] * LOG_2_LOW
        for n in range(len(some)):
            bits[n] = (np.int64(doublings[n]) + BIAS) << MANTISSA
        for n in range(len(some)):
            result[n] = scales[n] * _series(rests[n])


@inlined
def _series(x: float) -> float:
    """exp(x) for x within half the logarithm of 2, by its series."""
    far = 1 / 40320 + x * (1 / 362880 + x * (1 / 3628800 + x * (1 / 39916800 + x * (1 / 479001600 + x * (1 / 6227020800)))))
    return 1 + x * (1 + x * (1 / 2 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720 + x * (1 / 5040 + x * far)))))))


@njit
def _sum_of_products(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Sum of a (N,) times b (N,), several sums side by side: one alone would wait for each of its steps."""
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    whole = len(a) // 4 * 4
    for n in range(0, whole, 4):
        s0 += a[n] * b[n]
        s1 += a[n + 1] * b[n + 1]
        s2 += a[n + 2] * b[n + 2]
        s3 += a[n + 3] * b[n + 3]
    for n in range(whole, len(a)):
        s0 += a[n] * b[n]
    return (s0 + s1) + (s2 + s3)
