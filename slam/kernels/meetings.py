"""What a scan's points meet on the nearest-surface field. Unsigned indices make the loops over it 1.7 times as fast."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import inlined
from slam.kernels.sandwich import Sums
from slam.kernels.surfaces import FLATNESS, NORMAL_X, NORMAL_Y, ONE_SIDED, Field, X, Y

NOTHING, BEHIND, LONE, LINE = range(4)
"""What a point meets: nothing near, the other face of a wall, a lone point, a line."""
Meeting = tuple[int, float, float, float, float, float, float, float]
"""What, the point from the robot, the residual vector, the normal away from the robot, each (x, y) [m], the weight by Geman, McClure."""
NO_MEETING = (NOTHING, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
Flat = tuple[NDArray[np.int32], NDArray[np.float32], int, int]
"""A field's arrays without their rows, and how many rows and columns there are."""
Placed = tuple[float, float, float, float, float, float, float]
"""Of a pose x, y [m], the heading's cosine and sine; cells a metre; square of the kernel's width [m^2], weight of a lone point."""


@inlined
def flat_of(field: Field) -> Flat:
    """A field as the loops take it."""
    nearest, surfaces, _ = field
    return nearest.reshape(-1), surfaces.reshape(-1), nearest.shape[0], nearest.shape[1]


@inlined
def placed_at(pose: tuple[float, float, float], field: Field, kernel: tuple[float, float]) -> Placed:
    """A pose (3,) as the loops take it; `kernel` is the width [m] and the weight of a lone point."""
    return pose[0], pose[1], np.cos(pose[2]), np.sin(pose[2]), 1.0 / field[2], kernel[0] * kernel[0], kernel[1]


@inlined
def meeting(px: float, py: float, placed: Placed, field: Flat) -> Meeting:
    """The surface nearest to a point of the robot's frame."""
    x0, y0, c, s, scale, k2, lone = placed
    cells, flat, height, width = field
    rx, ry = c * px - s * py, s * px + c * py
    x, y = rx + x0, ry + y0
    if not (x >= 0.0 and y >= 0.0):
        return NO_MEETING
    col, row = np.int32(x * scale), np.int32(y * scale)
    if row >= height or col >= width:
        return NO_MEETING
    cell = cells[np.uint32(row * width + col)]
    if cell < 0:
        return NO_MEETING
    at = np.uint32(5 * cell)
    dx, dy, flatness = x - flat[np.uint32(at + X)], y - flat[np.uint32(at + Y)], flat[np.uint32(at + FLATNESS)]
    if flatness <= 0.0:
        w = k2 / (k2 + dx * dx + dy * dy)
        return LONE, rx, ry, dx, dy, 0.0, 0.0, w * w * lone
    nx, ny = float(flat[np.uint32(at + NORMAL_X)]), float(flat[np.uint32(at + NORMAL_Y)])
    away, d = nx * rx + ny * ry, nx * dx + ny * dy
    kind = BEHIND if flatness == ONE_SIDED and away > 0.0 else LINE
    w = k2 / (k2 + d * d)
    side = -1.0 if away < 0.0 else 1.0
    return kind, rx, ry, d * nx, d * ny, side * nx, side * ny, w * w


@inlined
def added(sums: Sums, met: Meeting) -> Sums:
    """A block's sums with one point more."""
    kind, rx, ry, dx, dy, nx, ny, w = met
    h00, h01, h02, h11, h12, h22, g0, g1, g2, a0, a1, a2 = sums
    g0, g1, g2 = g0 + w * dx, g1 + w * dy, g2 + w * (dy * rx - dx * ry)
    if kind == LINE:
        turn = ny * rx - nx * ry
        wx, wy, wt = w * nx, w * ny, w * turn
        h00, h01, h02, h11, h12, h22 = h00 + wx * nx, h01 + wx * ny, h02 + wx * turn, h11 + wy * ny, h12 + wy * turn, h22 + wt * turn
        a0, a1, a2 = a0 + wx, a1 + wy, a2 + wt
    else:
        h00, h02, h11, h12, h22 = h00 + w, h02 - w * ry, h11 + w, h12 + w * rx, h22 + w * (rx * rx + ry * ry)
        a0, a1, a2 = a0 + w, a1 + w, a2 + w * (rx - ry)
    return h00, h01, h02, h11, h12, h22, g0, g1, g2, a0, a1, a2


@inlined
def judged(quality: tuple[float, float, int], met: Meeting, placed: Placed) -> tuple[float, float, int]:
    """Sum of the weights of the points on lines, of their weighed squares, and how many points are within the kernel of anything."""
    total, squares, found = quality
    d2 = met[3] * met[3] + met[4] * met[4]
    w = met[7] if met[0] == LINE else 0.0
    return total + w, squares + w * d2, found + (d2 < placed[5])
