"""What can be seen of a place, from wherever a robot can get to in it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Bytes = NDArray[np.uint8]


@njit
def outline_cells(blocked: Bytes, segments: NDArray[np.float64]) -> None:
    """Set the cells that segments (N, 4) of x0 y0 x1 y1 [cells] run through."""
    for i in range(len(segments)):
        x0, y0, x1, y1 = segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3]
        count = int(4.0 * math.hypot(x1 - x0, y1 - y0)) + 1
        for k in range(count + 1):
            share = k / count
            blocked[int(y0 + share * (y1 - y0)), int(x0 + share * (x1 - x0))] = 1


@njit
def visible(blocked: Bytes, places: NDArray[np.int64], reach: float, rays: int) -> Bytes:
    """1 for the free cells that are seen from any of the places (N, 2), given as (row, col), within `reach` [cells]."""
    seen = np.zeros_like(blocked)
    for k in range(rays):
        angle = k * (2.0 * math.pi / rays)
        dx, dy = math.cos(angle), math.sin(angle)
        for i in range(len(places)):
            _look(blocked, seen, (places[i, 1] + 0.5, places[i, 0] + 0.5), (dx, dy, reach))
    return seen


@njit
def unseen_in_view(blocked: Bytes, unseen: NDArray[np.bool_], places: NDArray[np.int64], reach: float, rays: int) -> NDArray[np.int64]:
    """How many cells of `unseen` (H, W) are seen from each of the places (N, 2), as `visible` has it."""
    counts, seen, bound = np.zeros(len(places), np.int64), np.zeros_like(blocked), math.ceil(reach) + 1
    for i in range(len(places)):
        row, col = places[i, 0], places[i, 1]
        for k in range(rays):
            angle = k * (2.0 * math.pi / rays)
            _look(blocked, seen, (col + 0.5, row + 0.5), (math.cos(angle), math.sin(angle), reach))
        around = seen[max(row - bound, 0) : row + bound + 1, max(col - bound, 0) : col + bound + 1]
        wanted = unseen[max(row - bound, 0) : row + bound + 1, max(col - bound, 0) : col + bound + 1]
        counts[i] = np.sum(around * wanted)
        around[:] = 0
    return counts


@njit
def _look(blocked: Bytes, seen: Bytes, place: tuple[float, float], ray: tuple[float, float, float]) -> None:
    """Mark the free cells along one ray; Amanatides and Woo's traversal."""
    (x, y), (dx, dy, reach) = place, ray
    col, row = int(x), int(y)
    step_x, step_y = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
    delta_x, delta_y = abs(1.0 / dx), abs(1.0 / dy)  # inf along an axis
    next_x, next_y = 0.5 * delta_x, 0.5 * delta_y
    gone = 0.0
    while gone < reach and 0 <= row < len(blocked) and 0 <= col < blocked.shape[1] and blocked[row, col] == 0:
        seen[row, col] = 1
        gone = min(next_x, next_y)
        if next_x < next_y:
            next_x += delta_x
            col += step_x
        else:
            next_y += delta_y
            row += step_y
