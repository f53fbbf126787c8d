"""A short tour through places, as an order of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
LEAST = 1e-9
"""What a change must make a tour shorter by."""


@njit
def tour(ways: Floats, lengths: Floats) -> NDArray[np.int64]:
    """An order (N,) in which to go to places: the nearest next, then improved by turning stretches about.

    Croes, "A method for solving traveling-salesman problems" (1958), on an open tour.

    Args:
        ways: (N,) from where the tour begins to each place.
        lengths: (N, N) from place to place, the same there and back.
    """
    order = _nearest_next(ways, lengths)
    improved = True
    while improved:
        improved = False
        for i in range(len(order) - 1):
            for k in range(i + 1, len(order)):
                if _gain(order, ways, lengths, i, k) > LEAST:
                    order[i : k + 1] = order[i : k + 1][::-1].copy()
                    improved = True
    return order


@njit
def _nearest_next(ways: Floats, lengths: Floats) -> NDArray[np.int64]:
    order = np.zeros(len(ways), np.int64)
    left = np.ones(len(ways), np.bool_)
    order[0] = np.argmin(ways)
    left[order[0]] = False
    for n in range(1, len(order)):
        order[n] = np.argmin(np.where(left, lengths[order[n - 1]], np.inf))
        left[order[n]] = False
    return order


@njit
def _gain(order: NDArray[np.int64], ways: Floats, lengths: Floats, i: int, k: int) -> float:
    """By how much a tour gets shorter when its stretch from i to k is turned about."""
    first, last = order[i], order[k]
    gain = float(lengths[order[i - 1], first] - lengths[order[i - 1], last] if i else ways[first] - ways[last])
    if k + 1 < len(order):
        gain += float(lengths[last, order[k + 1]] - lengths[first, order[k + 1]])
    return gain
