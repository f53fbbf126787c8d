"""The likelihood field: Thrun, Burgard, Fox, Probabilistic Robotics (2005), table 6.3, as a table over the map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import contracted, njit
from slam.kernels.rays import direction
from slam.kernels.surfaces import FLATNESS, NORMAL_X, NORMAL_Y, X, Y

BLOCK = 256
"""Particles that are weighed together: what is known of them stays in the first cache."""
LENGTH = 1.5
"""Half the length of the surface of one cell [cells]: on a slanting wall so far may the nearest hits be apart."""


@njit
def distances(
    nearest: NDArray[np.int32],
    surfaces: NDArray[np.float32],
    hits: NDArray[np.float32],
    geometry: tuple[float, int],
    table: NDArray[np.float32],
) -> None:
    """Write the distance [m] of the centre of every small cell to the surface that is nearest to the map's cell around it.

    The surface of a cell is the line through its neighbours' hits, not much longer than the cell: beyond its end the distance grows again.

    Args:
        nearest: (H, W) flat index of the nearest occupied cell, -1 for none.
        surfaces: (H, W, 5) as in `slam.kernels.surfaces`.
        hits: (H, W, 2) mean hit minus cell centre [m].
        geometry: cell size of the map [m], small cells along the side of one of them.
        table: (k H + 2, k W + 2) written within its border, where a surface is known.
    """
    resolution, finer = geometry
    height, width = nearest.shape
    elements, offsets = surfaces.reshape(-1, 5), hits.reshape(-1, 2)
    for row in range(finer * height):
        for col in range(finer * width):
            cell = nearest[row // finer, col // finer]
            if cell < 0:
                continue
            x, y = (col + 0.5) * resolution / finer, (row + 0.5) * resolution / finer
            dx = x - (cell % width + 0.5) * resolution - offsets[cell, 0]
            dy = y - (cell // width + 0.5) * resolution - offsets[cell, 1]
            if elements[cell, FLATNESS] > 0.0:
                nx, ny = elements[cell, NORMAL_X], elements[cell, NORMAL_Y]
                along = max(abs(nx * dy - ny * dx) - LENGTH * resolution, 0.0)
                across = nx * (x - elements[cell, X]) + ny * (y - elements[cell, Y])
                table[row + 1, col + 1] = np.hypot(along, across)
            else:
                table[row + 1, col + 1] = np.hypot(dx, dy)


@contracted
def weigh(
    poses: NDArray[np.float64],
    frame: NDArray[np.float64],
    points: NDArray[np.float32],
    weights: NDArray[np.float32],
    table: NDArray[np.uint16],
    scale: tuple[float, float],
    log_likelihoods: NDArray[np.float64],
) -> None:
    """Write (N,) the weighted sums of the log-likelihoods of all points, for every particle.

    Beams outside, particles inside: sums of different particles do not wait for each other.

    Args:
        poses: (N, 3) T_map_base: x, y [m], yaw [rad].
        frame: (3,) T_map_table; its origin is the corner of the first cell within the border.
        points: (M, 2) in base [m].
        weights: (M,) how much each point counts.
        table: (H, W) likelihoods as steps below the best one, with a border that stands for everything outside.
        scale: cell size [m], log-likelihood of one step.
        log_likelihoods: (N,) written.
    """
    cells, per_metre = table.reshape(-1), np.float32(1.0 / scale[0])
    stride, right, top, zero = np.int32(table.shape[1]), np.int32(table.shape[1] - 1), np.int32(table.shape[0] - 1), np.int32(0)
    x, y, c, s = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    c0, s0 = direction(frame[2])
    index, sums = np.empty(BLOCK, np.int32), np.empty(BLOCK, np.float32)
    for start in range(0, len(poses), BLOCK):
        size = min(BLOCK, len(poses) - start)
        for k in range(size):
            dx, dy = poses[start + k, 0] - frame[0], poses[start + k, 1] - frame[1]
            cos, sin = direction(poses[start + k, 2] - frame[2])
            x[k], y[k] = (c0 * dx + s0 * dy) * per_metre + 1.0, (c0 * dy - s0 * dx) * per_metre + 1.0
            c[k], s[k], sums[k] = cos * per_metre, sin * per_metre, 0.0
        for i in range(len(points)):
            px, py, weight = points[i, 0], points[i, 1], weights[i]
            for k in range(size):
                col = np.int32(x[np.uint32(k)] + c[np.uint32(k)] * px - s[np.uint32(k)] * py)
                row = np.int32(y[np.uint32(k)] + s[np.uint32(k)] * px + c[np.uint32(k)] * py)
                col = zero if col < zero else col
                col = right if col > right else col
                row = zero if row < zero else row
                row = top if row > top else row
                index[np.uint32(k)] = row * stride + col
            for k in range(size):
                sums[np.uint32(k)] += weight * np.float32(cells[np.uint32(index[np.uint32(k)])])
        for k in range(size):
            log_likelihoods[start + k] = -scale[1] * sums[k]
