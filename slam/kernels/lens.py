"""Pixels and rays of a pinhole camera with Brown-Conrady distortion, in OpenCV's order k1 k2 p1 p2 k3."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Lens = tuple[float, float, float, float, Floats]
"""fx, fy, cx, cy [px] and D (5,)."""
ROUNDS = 30
CLOSE = 1e-10


@njit
def to_pixel(lens: Lens, x: float, y: float) -> tuple[float, float]:
    """Where a ray (x, y, 1) is seen: column, row [px]."""
    fx, fy, cx, cy, D = lens
    radial, dx, dy = _bending(D, x, y)
    return fx * (x * radial + dx) + cx, fy * (y * radial + dy) + cy


@njit
def to_ray(lens: Lens, column: float, row: float) -> tuple[float, float]:
    """The ray (x, y, 1) that is seen at column, row [px]: fixed-point iteration, as OpenCV's `undistortPoints` does."""
    fx, fy, cx, cy, D = lens
    x0, y0 = (column - cx) / fx, (row - cy) / fy
    x, y = x0, y0
    for _ in range(ROUNDS if D.any() else 0):
        radial, dx, dy = _bending(D, x, y)
        u, v = (x0 - dx) / radial, (y0 - dy) / radial
        step = abs(u - x) + abs(v - y)
        x, y = u, v
        if step < CLOSE:
            break
    return x, y


@njit
def _bending(D: Floats, x: float, y: float) -> tuple[float, float, float]:
    """Radial factor and tangential shift of a ray."""
    r2 = x * x + y * y
    radial = 1.0 + r2 * (D[0] + r2 * (D[1] + r2 * D[4]))
    return radial, 2.0 * D[2] * x * y + D[3] * (r2 + 2.0 * x * x), D[2] * (r2 + 2.0 * y * y) + 2.0 * D[3] * x * y
