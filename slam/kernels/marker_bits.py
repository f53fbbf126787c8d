"""Which marker is inside four corners: its modules, dark or bright, compared with a dictionary."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.planar_pose import homography

Grey = NDArray[np.uint8]
Floats = NDArray[np.float64]
Codes = NDArray[np.uint64]
SPOT = 0.2
"""A module is looked at in its middle and so far to all sides [modules]."""


@njit
def read_markers(grey: Grey, corners: Floats, codes: Codes, modules: int, tolerance: tuple[float, int, int]) -> NDArray[np.int64]:
    """Numbers in the dictionary and turns (N, 2): which corner in the picture is the marker's first; -1 where there is no marker.

    Args:
        grey: (H, W).
        corners: (N, 4, 2) clockwise in the picture [px].
        codes: (M, 4) bits of the markers, 1 where bright, row by row from the highest on, turned by no, one, two, three corners.
        modules: along a side, the two of the border included.
        tolerance: least contrast [grey levels]; how many modules of the border may be bright; how many bits may be wrong.
    """
    found = np.full((len(corners), 2), -1, np.int64)
    levels = np.empty((modules, modules))
    contrast, bright, wrong = tolerance
    for n in range(len(corners)):
        _look(grey, corners[n], levels)
        limit, rise = _parted(levels)
        if rise < contrast or _bright_border(levels, limit) > bright:
            continue
        bits, most = _packed(levels, limit), wrong
        for k in range(len(codes)):
            for turn in range(4):
                off = _ones(bits ^ codes[k, turn])
                if off <= most:
                    found[n, 0], found[n, 1], most = k, turn, off - 1
    return found


@njit
def _look(grey: Grey, corners: Floats, levels: Floats) -> None:
    """Write every module's mean grey level."""
    height, width = grey.shape
    n, H = len(levels), homography(corners, 0.5)
    for i in range(n):
        for j in range(n):
            total = 0.0
            for a in range(-1, 2):
                for b in range(-1, 2):
                    X, Y = (j + 0.5 + SPOT * b) / n - 0.5, 0.5 - (i + 0.5 + SPOT * a) / n
                    w = H[2, 0] * X + H[2, 1] * Y + 1.0
                    x, y = (H[0, 0] * X + H[0, 1] * Y + H[0, 2]) / w, (H[1, 0] * X + H[1, 1] * Y + H[1, 2]) / w
                    x, y = min(x if x > 0.0 else 0.0, width - 1.001), min(y if y > 0.0 else 0.0, height - 1.001)  # nan too
                    c, r = int(x), int(y)
                    u, v = x - c, y - r
                    upper, lower = (1.0 - u) * grey[r, c] + u * grey[r, c + 1], (1.0 - u) * grey[r + 1, c] + u * grey[r + 1, c + 1]
                    total += (1.0 - v) * upper + v * lower
            levels[i, j] = total / 9.0


@njit
def _parted(levels: Floats) -> tuple[float, float]:
    """The level between dark and bright, and the difference of their means: Otsu, "A threshold selection method" (1979)."""
    ordered = np.sort(levels.reshape(-1))
    count, total = len(ordered), ordered.sum()
    below, best, limit, rise = 0.0, -1.0, 0.0, 0.0
    for k in range(1, count):
        below += ordered[k - 1]
        apart = (total - below) / (count - k) - below / k
        if k * (count - k) * apart * apart > best:
            best, limit, rise = k * (count - k) * apart * apart, 0.5 * (ordered[k - 1] + ordered[k]), apart
    return limit, rise


@njit
def _bright_border(levels: Floats, limit: float) -> int:
    last, count = len(levels) - 1, 0
    for k in range(last):
        for level in (levels[0, k], levels[k, last], levels[last, k + 1], levels[k + 1, 0]):
            count += int(level > limit)
    return count


@njit
def _packed(levels: Floats, limit: float) -> np.uint64:
    bits, last = np.uint64(0), len(levels) - 1
    for i in range(1, last):
        for j in range(1, last):
            bits = (bits << np.uint64(1)) | np.uint64(levels[i, j] > limit)
    return bits


@njit
def _ones(word: np.uint64) -> int:
    """How many bits are set: Wegner, "A technique for counting ones" (1960)."""
    count = 0
    while word != np.uint64(0):
        word &= word - np.uint64(1)
        count += 1
    return count
