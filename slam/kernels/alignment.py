"""A depth image as another camera would see it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]


@njit
def align(
    depth: NDArray[np.float32], K_depth: Floats, T: tuple[Floats, Floats], lens: tuple[Floats, Floats], shape: tuple[int, int]
) -> NDArray[np.float32]:
    """Depth (H, W) [m] in the other camera's pixels; nan where it is not known. The nearest of what falls on a pixel counts.

    Each pixel covers the rectangle between where its upper left and its lower right corner fall, as in Intel's `rs2::align`.

    Args:
        depth: (h, w) [m], of a camera without distortion.
        K_depth: (3, 3) of that camera [px].
        T: rotation (3, 3) and translation (3,) [m] from it to the other camera.
        lens: K (3, 3) [px] and D (5,) of the other camera.
        shape: H and W.
    """
    (R, t), (K, D) = T, lens
    aligned = np.full(shape, np.nan, np.float32)
    for row in range(depth.shape[0]):
        for column in range(depth.shape[1]):
            z = depth[row, column]
            if not z > 0.0:
                continue
            left, top, _ = _projected(column - 0.5, row - 0.5, z, K_depth, R, t, K, D)
            right, bottom, far = _projected(column + 0.5, row + 0.5, z, K_depth, R, t, K, D)
            for r in range(max(int(np.ceil(top)), 0), min(int(np.floor(bottom)) + 1, shape[0])):
                for c in range(max(int(np.ceil(left)), 0), min(int(np.floor(right)) + 1, shape[1])):
                    if not aligned[r, c] <= far:
                        aligned[r, c] = far
    return aligned


@njit
def _projected(
    column: float, row: float, z: float, K_depth: Floats, R: Floats, t: Floats, K: Floats, D: Floats
) -> tuple[float, float, float]:
    """Column, row and depth in the other camera of a point that the depth camera sees at a place of its image."""
    x, y = (column - K_depth[0, 2]) / K_depth[0, 0] * z, (row - K_depth[1, 2]) / K_depth[1, 1] * z
    far = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z + t[2]
    u = (R[0, 0] * x + R[0, 1] * y + R[0, 2] * z + t[0]) / far
    v = (R[1, 0] * x + R[1, 1] * y + R[1, 2] * z + t[1]) / far
    r2 = u * u + v * v
    radial = 1.0 + r2 * (D[0] + r2 * (D[1] + r2 * D[4]))
    across = u * radial + 2.0 * D[2] * u * v + D[3] * (r2 + 2.0 * u * u)
    down = v * radial + D[2] * (r2 + 2.0 * v * v) + 2.0 * D[3] * u * v
    return across * K[0, 0] + K[0, 2], down * K[1, 1] + K[1, 2], far
