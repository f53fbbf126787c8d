"""Which points of a target a scan's belong to: Censi, "An ICP variant using a point-to-line metric" (2008). Unsigned where it pays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Pairs = tuple[NDArray[np.int64], Floats]
"""Target point (M,) of each source point, -1 for none, and the squared distance between the two (M,) [m^2]."""
COARSE = 100
"""So many points show the way; all of them are asked at the end."""
BINS = 128
"""Of the histogram of the correspondences' lengths."""
WINDOW = 4
"""Target points to each side of the last match that are looked at anyway; enough for a step of the width of the noise."""


@njit
def pair(source: Floats, stride: int, target: Floats, pose: Floats, settings: tuple[float, float, float, float], pairs: Pairs) -> float:
    """Write the correspondences that count of every n-th source point; returns the largest squared distance of one."""
    longest, trim, adaptive, last = settings
    farthest = min(4.0 * last, longest * longest)
    find(source, stride, target, pose, farthest, pairs)
    limit = _longest(pairs[1], max(stride, len(source) // COARSE), (trim, adaptive), farthest)
    found, squares = pairs
    for i in range(0, len(found), stride):
        if squares[i] > limit:
            found[i] = -1
    return limit


@njit
def find(source: Floats, stride: int, target: Floats, pose: Floats, farthest: float, pairs: Pairs, thorough: bool = True) -> None:
    """Write the nearest target point of every n-th source point.

    The search starts at the last match, goes by bearing and ends where no ray can come nearer than what it has: 5 to 10 points are
    looked at, as with CSM's jump tables. A `target` point is no nearer than its ray.
    """
    found, squares = pairs
    c, s = np.cos(pose[2]), np.sin(pose[2])
    n, begin = len(target), 0
    zero, one = np.uint32(0), np.uint32(1)
    for i in range(0, len(source), stride):
        x = c * source[i, 0] - s * source[i, 1] + pose[0]
        y = s * source[i, 0] + c * source[i, 1] + pose[1]
        if found[i] >= 0:
            begin = found[i]
        best, nearest = farthest, -1
        low, high = max(begin - WINDOW, 0), min(begin + WINDOW + 1, n)
        for j in range(np.uint32(low), np.uint32(high)):  # without a branch
            dx, dy = x - target[j, zero], y - target[j, one]
            d = dx * dx + dy * dy
            nearest = np.int64(j) if d < best else nearest
            best = min(d, best)
        if not thorough:
            found[i], squares[i] = nearest, best
            continue
        for j in range(np.uint32(max(high - 1, 0)), np.uint32(n)):
            qx, qy = target[j, zero], target[j, one]
            d = (x - qx) * (x - qx) + (y - qy) * (y - qy)
            if d < best:
                best, nearest = d, np.int64(j)
            beyond = qx * y - qy * x
            if beyond < 0.0 and beyond * beyond > best * (qx * qx + qy * qy):
                break
        for back in range(np.uint32(min(low + 1, n))):
            j = np.uint32(min(low, n - 1)) - back
            qx, qy = target[j, zero], target[j, one]
            d = (x - qx) * (x - qx) + (y - qy) * (y - qy)
            if d < best:
                best, nearest = d, np.int64(j)
            beyond = qx * y - qy * x
            if beyond > 0.0 and beyond * beyond > best * (qx * qx + qy * qy):
                break
        found[i], squares[i] = nearest, best
        if nearest >= 0:
            begin = nearest


@njit
def _longest(squares: Floats, stride: int, shares: tuple[float, float], farthest: float) -> float:
    """Largest squared distance of a correspondence that counts: trimmed, and adaptive as in CSM, from a histogram of the lengths."""
    counts = np.zeros(BINS, np.int64)
    n = 0
    for k in range(0, len(squares), stride):
        if squares[k] < farthest:
            counts[int(BINS * np.sqrt(squares[k] / farthest))] += 1
            n += 1
    below, most = 0, 0
    for k in range(BINS):
        below += counts[k]
        if below < 0.7 * n:
            most = k + 1
        if below >= shares[0] * n:
            edge = min(k + 1.0, shares[1] * (most + 1.0)) / BINS
            return min(edge * edge, 1.0) * farthest
    return farthest
