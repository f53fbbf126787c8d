"""The nearest obstacle in each direction of a depth image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]


@njit
def nearest(
    depth: NDArray[np.float32],
    K: Floats,
    T: tuple[Floats, Floats],
    band: tuple[float, float, float],
    bearings: tuple[float, float, int],
) -> Floats:
    """Horizontal range (N,) [m] in each direction, nan where no pixel looks at the band, or none of those that do was measured.

    Args:
        depth: (H, W) along the optical axis [m], nan where nothing was measured; no distortion.
        K: (3, 3) [px].
        T: rotation (3, 3) from the camera to the level frame at its place, and its place (3,) above the floor [m].
        band: lowest and highest obstacle above the floor, farthest range [m].
        bearings: first direction and step from one to the next [rad], and how many.
    """
    R, t = T
    low, high, range_max = band
    first, step, count = bearings
    squares = np.full(count, np.inf)
    for row in range(depth.shape[0]):
        v = (row - K[1, 2]) / K[1, 1]
        for column in range(depth.shape[1]):
            z = depth[row, column]
            if not z > 0.0:
                continue
            u = (column - K[0, 2]) / K[0, 0]
            height = t[2] + z * (R[2, 0] * u + R[2, 1] * v + R[2, 2])
            if height < low or height > high:
                continue
            x = z * (R[0, 0] * u + R[0, 1] * v + R[0, 2])
            y = z * (R[1, 0] * u + R[1, 1] * v + R[1, 2])
            square = x * x + y * y
            if square > range_max * range_max:
                continue
            bearing = int(np.floor((np.arctan2(y, x) - first) / step + 0.5))
            if 0 <= bearing < count and square < squares[bearing]:
                squares[bearing] = square
    ranges = np.sqrt(squares)
    ranges[np.isinf(ranges)] = np.nan
    return ranges
