"""The likelihood field: Thrun, Burgard, Fox, Probabilistic Robotics (2005), table 6.3, as a table over the map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import contracted, njit
from slam.kernels.rays import direction, short_direction
from slam.kernels.surfaces import FLATNESS, NORMAL_X, NORMAL_Y, X, Y

BLOCK = 256
"""Particles that are weighed together: what is known of them stays in the first cache."""
TOGETHER = 4
"""Beams that are looked up together."""
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
    table: NDArray[np.float32],
    cell: float,
    log_likelihoods: NDArray[np.float64],
) -> None:
    """Write (N,) the weighted sums of the log-likelihoods of all points, for every particle.

    Beams outside, particles inside: sums of different particles do not wait for each other, and all look up the same few cells.

    Args:
        poses: (N, 3) T_map_base: x, y [m], yaw [rad].
        frame: (3,) T_map_table; its origin is the corner of the first cell within the border.
        points: (M, 2) in base [m]; M is a multiple of `TOGETHER`.
        weights: (M,) how much each point counts.
        table: (H, W) log-likelihoods, with a border that stands for everything outside.
        cell: its size [m].
        log_likelihoods: (N,) written.
    """
    states, ends, cells = np.empty(4 * BLOCK, np.float32), np.empty(TOGETHER * BLOCK, np.uint32), table.reshape(-1)
    sums = np.empty(BLOCK, np.float32)
    for start in range(0, len(poses), BLOCK):
        size = min(BLOCK, len(poses) - start)
        _in_table(poses[start : start + size], frame, 1.0 / cell, states)
        sums[:] = 0.0
        for i in range(0, len(points), TOGETHER):
            for j in range(TOGETHER):
                _cells_at(states, size, points[i + j], table.shape, ends[j * BLOCK :])
            _add(cells, ends, weights[i : i + TOGETHER], sums[:size])
        log_likelihoods[start : start + size] = sums[:size]


@contracted
def _in_table(poses: NDArray[np.float64], frame: NDArray[np.float64], per_metre: float, states: NDArray[np.float32]) -> None:
    """Write x, y, cosine and sine of poses (K, 3) one after the other, each with room for a block, in the table's cells."""
    c0, s0 = direction(frame[2])
    for k in range(len(poses)):
        dx, dy = poses[k, 0] - frame[0], poses[k, 1] - frame[1]
        c, s = short_direction(poses[k, 2] - frame[2])
        u = np.uint32(k)
        states[u] = (c0 * dx + s0 * dy) * per_metre + 1.0
        states[u + np.uint32(BLOCK)] = (c0 * dy - s0 * dx) * per_metre + 1.0
        states[u + np.uint32(2 * BLOCK)] = c * per_metre
        states[u + np.uint32(3 * BLOCK)] = s * per_metre


@contracted
def _cells_at(states: NDArray[np.float32], size: int, point: NDArray[np.float32], shape: tuple[int, int], ends: NDArray[np.uint32]) -> None:
    """Write the flat index (K,) of the cell in which a point (2,) lies for each of the first particles of a block."""
    px, py, stride, zero = point[0], point[1], np.int32(shape[1]), np.int32(0)
    right, top = np.int32(shape[1] - 1), np.int32(shape[0] - 1)
    for k in range(size):
        u = np.uint32(k)
        c, s = states[u + np.uint32(2 * BLOCK)], states[u + np.uint32(3 * BLOCK)]
        col = np.int32(states[u] + c * px - s * py)
        row = np.int32(states[u + np.uint32(BLOCK)] + s * px + c * py)
        col = zero if col < zero else col
        col = right if col > right else col
        row = zero if row < zero else row
        row = top if row > top else row
        ends[u] = row * stride + col


@contracted
def _add(cells: NDArray[np.float32], ends: NDArray[np.uint32], weights: NDArray[np.float32], sums: NDArray[np.float32]) -> None:
    """Add what some beams say of each particle: several at once, for a sum that is not written for each of them is twice as fast."""
    w0, w1, w2, w3 = weights[0], weights[1], weights[2], weights[3]
    for k in range(len(sums)):
        u = np.uint32(k)
        first = w0 * cells[ends[u]] + w1 * cells[ends[u + np.uint32(BLOCK)]]
        sums[u] += first + (w2 * cells[ends[u + np.uint32(2 * BLOCK)]] + w3 * cells[ends[u + np.uint32(3 * BLOCK)]])
