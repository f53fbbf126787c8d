"""Drawing particles by their weights: Thrun, Burgard, Fox, Probabilistic Robotics (2005), table 4.4."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit


@njit
def systematic(weights: NDArray[np.float64], offset: float, count: int) -> NDArray[np.int64]:
    """Indices (count,) of the particles drawn by one random number: low-variance resampling, in one pass.

    Args:
        weights: (N,) not negative, their sum above 0.
        offset: uniform in [0, 1).
        count: how many to draw.
    """
    parents = np.empty(count, np.int64)
    total = weights.sum()
    passed, reached = np.zeros(count + 1, np.int64), 0.0
    for i in range(len(weights) - 1):  # no branch that depends on the weights: a wrong guess of the processor costs as much as ten steps
        reached += weights[i]
        passed[min(max(int(np.ceil(reached * (count / total) - offset)), 0), count)] += 1
    i = 0
    for k in range(count):
        i += passed[k]
        parents[k] = i
    return parents
