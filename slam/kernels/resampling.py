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
    step, last = total / count, len(weights) - 1
    i, reached = 0, weights[0]
    for k in range(count):
        wanted = (k + offset) * step
        while reached <= wanted and i < last:
            i += 1
            reached += weights[i]
        parents[k] = i
    return parents
