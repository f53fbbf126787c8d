"""The beam model: Thrun, Burgard, Fox, Probabilistic Robotics (2005), table 6.1, by exact rays through the map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.rays import cast_along, directions


@njit
def weigh(
    poses: NDArray[np.float64],
    beams: NDArray[np.float64],
    weights: NDArray[np.float64],
    squares: NDArray[np.uint8],
    table: NDArray[np.float32],
    sizes: tuple[float, float],
    log_likelihoods: NDArray[np.float64],
) -> None:
    """Write (N,) the weighted sums of the log-likelihoods of all beams, for every particle.

    Args:
        poses: (N, 3) x, y [m], yaw in the frame of the map's cells.
        beams: (M, 4) where each starts in base [m], its bearing in base [rad], its range [m].
        weights: (M,) how much each beam counts.
        squares: of `slam.kernels.rays.empty_squares`.
        table: (B, B) log-likelihood of the range in bin i where the map says bin j; the last is the sensor's range and beyond.
        sizes: of the map's cells and of the bins [m].
        log_likelihoods: (N,) written.
    """
    last = len(table) - 1
    per_metre, reach = 1.0 / sizes[1], last * sizes[1]
    measured = np.empty(len(beams), np.int64)
    for i in range(len(beams)):
        measured[i] = min(int(beams[i, 3] * per_metre), last)
    bearings = directions(beams[:, :3])
    rays, headings = np.empty((len(beams), 2)), np.empty((2, len(beams)))
    for n in range(len(poses)):
        x, y, yaw = poses[n, 0], poses[n, 1], poses[n, 2]
        c, s = np.cos(yaw), np.sin(yaw)
        for i in range(len(beams)):
            rays[i, 0] = x + c * beams[i, 0] - s * beams[i, 1]
            rays[i, 1] = y + s * beams[i, 0] + c * beams[i, 1]
            headings[0, i] = c * bearings[0, i] - s * bearings[1, i]
            headings[1, i] = s * bearings[0, i] + c * bearings[1, i]
        expected = cast_along(squares, rays, headings, sizes[0], reach)
        total = 0.0
        for i in range(len(beams)):
            col = min(int(expected[i] * per_metre), last) if expected[i] < reach else last
            total += weights[i] * table[measured[i], col]  # what particles expect of one beam lies side by side
        log_likelihoods[n] = total
