"""Fewer points for the same scan, the fewer the coarser the look at it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Clouds = tuple[Floats, Integers, Integers, Integers]
"""Points x, y [cells] in base of all levels in a row (M, 2), how many beams each stands for (M,), where each level begins (L + 2,),
headings in a group of each level (L + 1,)."""


@njit
def merge(points: Floats, beams: Integers, radius: float) -> tuple[Floats, Integers]:
    """One representative (K, 2) for runs of successive points (N, 2) that all lie within `radius` of it, and the sums of their `beams`."""
    merged, counts = np.empty(points.shape), np.zeros(len(points), np.int64)
    n, low_x, high_x, low_y, high_y = -1, np.inf, -np.inf, np.inf, -np.inf
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
        if n < 0 or (high_x - low_x) ** 2 + (high_y - low_y) ** 2 > 4.0 * radius * radius:
            n += 1
            low_x, high_x, low_y, high_y = x, x, y, y
        merged[n, 0], merged[n, 1] = 0.5 * (low_x + high_x), 0.5 * (low_y + high_y)
        counts[n] += beams[i]
    return merged[: n + 1], counts[: n + 1]


@njit
def make_clouds(points: Floats, levels: int, step: float) -> Clouds:
    """Clouds of all levels of points (N, 2) [cells]: up to half of a level's m cells is for its headings, what is left for merging."""
    farthest = 0.0
    for i in range(len(points)):
        farthest = max(farthest, np.hypot(points[i, 0], points[i, 1]))
    all_points, all_weights = np.empty(((levels + 1) * len(points), 2)), np.empty((levels + 1) * len(points), np.int64)
    begins, groups = np.zeros(levels + 2, np.int64), np.ones(levels + 1, np.int64)
    beams = np.ones(len(points), np.int64)
    for level in range(levels + 1):
        slack = float((1 << level) // 4)
        while level > 0 and 0.5 * (2 * groups[level] - 1) * step * farthest <= 0.5 * slack:
            groups[level] *= 2
        turned = 0.5 * (groups[level] - 1) * step * farthest
        merged, counts = merge(points, beams, slack - turned) if slack > 0.0 else (points, beams)
        for i in range(len(merged)):  # copying slices would take five seconds to compile
            all_points[begins[level] + i, 0], all_points[begins[level] + i, 1] = merged[i, 0], merged[i, 1]
            all_weights[begins[level] + i] = counts[i]
        begins[level + 1] = begins[level] + len(merged)
    return all_points[: begins[-1]], all_weights[: begins[-1]], begins, groups
