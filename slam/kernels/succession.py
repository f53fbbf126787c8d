"""Whether one scan can follow another: what both see must be at the same place."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
BEARINGS = 180
"""Sectors of a turn, in each of which the nearest and the farthest point are kept."""


@njit
def agreement(before: Floats, now: Floats, step: Floats, tolerance: tuple[float, float]) -> tuple[float, int]:
    """Share of the points `now` (N, 2) that lie between what the scan before saw (M, 2) about their bearing, and how many were compared.

    Both in their own base, about which bearings are taken: a lidar is not far from there [m]. A point in a direction in which the scan
    before saw nothing is not compared.

    Args:
        before: (M, 2) points of the scan before [m].
        now: (N, 2) points of the next [m].
        step: (3,) T_before_now: x, y [m], yaw [rad].
        tolerance: least difference [m], and as a share of the range.
    """
    nearest, farthest = np.full(BEARINGS, np.inf), np.zeros(BEARINGS)
    scale = BEARINGS / (2.0 * math.pi)
    for i in range(len(before)):
        at = int((math.atan2(before[i, 1], before[i, 0]) + math.pi) * scale) % BEARINGS
        length = math.hypot(before[i, 0], before[i, 1])
        for sector in (at - 1, at, at + 1):
            nearest[sector % BEARINGS] = min(nearest[sector % BEARINGS], length)
            farthest[sector % BEARINGS] = max(farthest[sector % BEARINGS], length)
    c, s = math.cos(step[2]), math.sin(step[2])
    same, compared = 0, 0
    for i in range(len(now)):
        x, y = step[0] + c * now[i, 0] - s * now[i, 1], step[1] + s * now[i, 0] + c * now[i, 1]
        at = int((math.atan2(y, x) + math.pi) * scale) % BEARINGS
        if farthest[at] > 0.0:
            length = math.hypot(x, y)
            margin = max(tolerance[0], tolerance[1] * length)
            compared += 1
            same += nearest[at] - margin <= length <= farthest[at] + margin
    return same / max(compared, 1), compared
