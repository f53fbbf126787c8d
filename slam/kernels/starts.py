"""From where to go down on the error table when nothing is known of the pose."""

from __future__ import annotations

import numpy as np

from slam.kernels.jit import njit
from slam.kernels.rprop import Schedule, Stage, rprop
from slam.kernels.table_error import Floats, Table, error


@njit
def rank(points: Floats, places: Floats, headings: Floats, table: Table, c: float) -> Floats:
    """E (K, H) of points (M, 2) at places (K, 2) with headings (H,), in the table's frame."""
    patches, cell = table
    height, width = patches.shape[0], patches.shape[1]
    flat, scale, c2 = patches.reshape(-1), 1.0 / cell, c * c
    found, turned_points = np.empty((len(places), len(headings))), np.empty((len(points), 2))
    for h in range(len(headings)):
        cos, sin = np.cos(headings[h]) * scale, np.sin(headings[h]) * scale
        for i in range(len(points)):
            turned_points[i, 0] = cos * points[i, 0] - sin * points[i, 1]
            turned_points[i, 1] = sin * points[i, 0] + cos * points[i, 1]
        for k in range(len(places)):
            x, y, total = places[k, 0] * scale, places[k, 1] * scale, 0.0
            for i in range(len(points)):
                u, v = x + turned_points[np.uint32(i), 0], y + turned_points[np.uint32(i), 1]
                col, row = np.int32(u), np.int32(v)
                if u >= 0.0 and v >= 0.0 and row < height and col < width:
                    d = np.float64(flat[np.uint32(4 * (row * width + col))])
                    total += d * d / (c2 + d * d)
                else:
                    total += 1.0
            found[k, h] = total
    return found


@njit
def refine(
    points: Floats,
    stride: int,
    starts: Floats,
    table: Table,
    stages: tuple[Stage, Stage],
    schedule: Schedule,
) -> tuple[Floats, Floats]:
    """Poses (K, 3) that both stages reach from starts (K, 3) with every `stride`-th point, and E (K,) of all points there."""
    nothing = (np.zeros(3), np.zeros((3, 3)))
    poses, errors, gradient = np.empty_like(starts), np.empty(len(starts)), np.empty(3)
    for k in range(len(starts)):
        pose, _, _ = rprop(points, stride, starts[k], table, stages[0], nothing, schedule)
        pose, _, _ = rprop(points, stride, pose, table, stages[1], nothing, schedule)
        poses[k] = pose
        errors[k] = error(points, 1, pose, table, stages[1][0], nothing, gradient)
    return poses, errors
