"""Tables of how well a point at a cell fits a map, and of the best score in ever larger blocks of cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Scores = NDArray[np.uint8]


@njit
def splat(scores: Scores, points: NDArray[np.float64], sigma: float) -> None:
    """Raise `scores` (H, W) to a Gaussian of height 255 and width `sigma` [cells] about each of the points (N, 2) x, y [cells]."""
    height, width = scores.shape
    reach = int(np.ceil(3.0 * sigma))
    across = np.empty(2 * reach + 1)
    for i in range(len(points)):
        left, low = int(np.floor(points[i, 0])) - reach, int(np.floor(points[i, 1])) - reach
        for k in range(len(across)):
            d = (left + k + 0.5 - points[i, 0]) / sigma
            across[k] = np.exp(-0.5 * d * d)
        for row in range(max(low, 0), min(low + len(across), height)):
            d = (row + 0.5 - points[i, 1]) / sigma
            along = 255.0 * np.exp(-0.5 * d * d)
            for col in range(max(left, 0), min(left + len(across), width)):
                score = np.uint8(along * across[col - left] + 0.5)
                scores[row, col] = max(scores[row, col], score)


@njit
def clear_rays(free: NDArray[np.bool_], starts: NDArray[np.float64], ends: NDArray[np.float64]) -> None:
    """Mark the cells (H, W) that rays from `starts` to `ends` (N, 2) x, y [cells] cross, sampled every half cell."""
    height, width = free.shape
    for i in range(len(starts)):
        dx, dy = ends[i, 0] - starts[i, 0], ends[i, 1] - starts[i, 1]
        steps = int(2.0 * max(abs(dx), abs(dy))) + 1
        for k in range(steps):
            x, y = starts[i, 0] + dx * k / steps, starts[i, 1] + dy * k / steps
            if 0.0 <= x < width and 0.0 <= y < height:
                free[int(y), int(x)] = True


@njit
def pool(scores: Scores, largest: Scores, shift: int, outside: int) -> None:
    """Write to `largest` (H, W) the best of four scores, `shift` cells apart to the right and up; off the table is `outside`."""
    height, width = scores.shape
    for row in range(height):
        target, near = largest[row], scores[row]
        if row < height - shift:
            far = scores[row + shift]
            for col in range(width):
                target[col] = max(near[col], far[col])
        else:
            for col in range(width):
                target[col] = max(near[col], np.uint8(outside))
        for col in range(width - shift):  # rightwards, so that what is read is not yet written
            target[col] = max(target[col], target[col + shift])
        for col in range(width - shift, width):
            target[col] = max(target[col], np.uint8(outside))
