"""A scan as the lines about its points, for others to be laid over."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.localizability import in_order, running_sums, scatter
from slam.kernels.sandwich import JUMP

Floats = NDArray[np.float64]
Target = tuple[Floats, Floats]
"""Points (N, 2) in the order of their bearings, and the line about each (N, 5): point on it, normal, 1 or 0 where there is none."""


@njit
def prepare(points: Floats, half: float) -> Target:
    """The target of points (N, 2) [m] in any order, with lines through what lies up to `half` [m] beside each point on the same thing.

    The line through the two nearest points alone, as in the paper, turns with their noise: at 1 cm between beams by 45 degrees.
    """
    points = in_order(points)
    n = len(points)
    sums, lines = running_sums(points), np.zeros((n, 5))
    breaks = np.zeros(n + 1, np.int64)  # of the thing that each point lies on: how many jumps come before it
    for i in range(1, n):
        jump = (points[i, 0] - points[i - 1, 0]) ** 2 + (points[i, 1] - points[i - 1, 1]) ** 2 > JUMP * JUMP
        breaks[i] = breaks[i - 1] + jump
    first = last = 0
    for i in range(n):
        first, last = max(first, 0), max(last, i)
        while breaks[first] < breaks[i] or (first < i and _apart(points, first, i) > half * half):
            first += 1
        while last + 1 < n and breaks[last + 1] == breaks[i] and _apart(points, last + 1, i) <= half * half:
            last += 1
        if last - first >= 2:
            _fit(sums, first, last + 1, lines[i])
    return points, lines


@njit
def _apart(points: Floats, i: int, j: int) -> float:
    return (points[i, 0] - points[j, 0]) ** 2 + (points[i, 1] - points[j, 1]) ** 2


@njit
def _fit(sums: Floats, first: int, last: int, line: Floats) -> None:
    """Write mean and normal of the points from `first` to before `last`."""
    mx, my, a, b, d = scatter(sums, first, last)
    # the normal is the eigenvector of the smaller eigenvalue
    small = 0.5 * (a + d) - np.sqrt(0.25 * (a - d) ** 2 + b * b)
    nx, ny = (b, small - a) if a > d else (small - d, b)
    length = np.sqrt(nx * nx + ny * ny)
    if length > 0.0:
        line[0], line[1], line[2], line[3], line[4] = mx, my, nx / length, ny / length, 1.0
