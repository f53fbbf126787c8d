"""Which beams of a sweep have met two surfaces at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Model = tuple[float, float, float]
LEVEL, OUT, IN, APART = 0, 1, 2, 3
"""The second of two points: at the same depth, farther, nearer, or not a neighbour."""


@njit
def unveil(
    ranges: NDArray[np.float64], angles: NDArray[np.float64], limits: tuple[float, float], model: Model, window: int
) -> NDArray[np.float64]:
    """Ranges (N,) [m] with nan in place of those that hang behind a surface and have no neighbour at their own depth.

    A surface is a point with a neighbour at its own depth: on a wall met so flat that no point has one, all points stay.

    Args:
        ranges: (N,) [m]; beams that are not finite or outside `limits` are nobody's neighbours.
        angles: (N,) [rad].
        limits: nearest and farthest range that counts [m].
        model: least tolerance of two ranges of one surface [m], tolerance as a share of the range, cotangent of the flattest angle at
            which a surface is met.
        window: how many beams off the nearest valid neighbour may be.
    """
    valid = np.flatnonzero((ranges >= limits[0]) & (ranges <= limits[1]))
    steps = np.empty(len(valid) + 1, np.int8)  # from the point before to each point
    steps[0] = steps[-1] = APART
    for k in range(1, len(valid)):
        steps[k] = _step(ranges, angles, (valid[k - 1], valid[k]), model) if valid[k] - valid[k - 1] <= window else APART
    clean = ranges.copy()
    for k in range(len(valid)):
        if steps[k] == LEVEL or steps[k + 1] == LEVEL:
            continue
        behind = steps[k] == OUT or steps[k + 1] == IN
        beside = (k > 0 and steps[k] != APART and steps[k - 1] == LEVEL) or (
            k + 2 < len(steps) and steps[k + 1] != APART and steps[k + 2] == LEVEL
        )
        if behind and beside:
            clean[valid[k]] = np.nan
    return clean


@njit
def _step(ranges: NDArray[np.float64], angles: NDArray[np.float64], pair: tuple[np.int64, np.int64], model: Model) -> int:
    """How the second beam of a pair lies to the first."""
    first, second, angle = ranges[pair[0]], ranges[pair[1]], abs(angles[pair[1]] - angles[pair[0]])
    near = min(first, second)
    tolerance = max(model[0], model[1] * near) + near * angle * model[2]
    if abs(second - first) <= tolerance:
        return LEVEL
    return OUT if second > first else IN
