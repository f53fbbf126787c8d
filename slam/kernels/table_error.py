"""The error of a pose on the error table: Lauer, Lange, Riedmiller, "Calculating the perfect match" (RoboCup 2005).

Poses and points are in the table's own frame: its corner (0, 0) is the origin.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Table = tuple[NDArray[np.float32], float]
"""Interpolants (H, W, 4) of the distance in each cell, cell size [m]."""
Prior = tuple[Floats, Floats]
"""Mean (3,) and information (3, 3) of the pose, in units of the error: what odometry says."""
X, Y, XY = 1, 2, 3
"""Coefficients of an interpolant after its constant."""


@njit
def error(points: Floats, stride: int, pose: Floats, table: Table, c: float, prior: Prior, gradient: Floats) -> float:
    """E(x, y, yaw), the sum of e(d) = 1 - c^2 / (c^2 + d^2) over the observed points, plus what the prior costs; writes its gradient (3,).

    Points (M, 2) [m] are in base, of which every `stride`-th counts. Outside the table the distance is that of its border: no pull.
    """
    patches, cell = table
    height, width = patches.shape[0], patches.shape[1]
    flat, scale, c2 = patches.reshape(-1), 1.0 / cell, c * c
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    total = gx = gy = gt = 0.0
    for i in range(0, len(points), stride):
        rx = cos * points[np.uint32(i), 0] - sin * points[np.uint32(i), 1]
        ry = sin * points[np.uint32(i), 0] + cos * points[np.uint32(i), 1]
        u, v = (rx + pose[0]) * scale, (ry + pose[1]) * scale
        if not (u >= 0.0 and v >= 0.0):
            total += 1.0
            continue
        col, row = np.int32(u), np.int32(v)
        if row >= height or col >= width:
            total += 1.0
            continue
        at = np.uint32(4 * (row * width + col))
        p1, p2, p3 = flat[np.uint32(at + X)], flat[np.uint32(at + Y)], flat[np.uint32(at + XY)]
        a, b = u - col, v - row
        da, db = p1 + p3 * b, p2 + p3 * a
        d = flat[at] + p1 * a + db * b
        share = 1.0 / (c2 + d * d)
        total += d * d * share
        pull = d * share * share  # e'(d) = 2 c^2 d / (c^2 + d^2)^2
        dx, dy = pull * da, pull * db
        gx += dx
        gy += dy
        gt += dy * rx - dx * ry
    gain = 2.0 * c2 * scale * stride
    o0, o1, o2 = pose[0] - prior[0][0], pose[1] - prior[0][1], pose[2] - prior[0][2]
    W = prior[1]
    q0 = W[0, 0] * o0 + W[0, 1] * o1 + W[0, 2] * o2
    q1 = W[1, 0] * o0 + W[1, 1] * o1 + W[1, 2] * o2
    q2 = W[2, 0] * o0 + W[2, 1] * o1 + W[2, 2] * o2
    gradient[0], gradient[1], gradient[2] = gain * gx + q0, gain * gy + q1, gain * gt + q2
    return stride * total + 0.5 * (o0 * q0 + o1 * q1 + o2 * q2)


@njit
def explained(points: Floats, pose: Floats, table: Table, c: float) -> float:
    """Share of points (M, 2) nearer than c to a wall."""
    J, r, places = np.empty((len(points), 3)), np.empty(len(points)), np.empty((len(points), 2))
    n = residuals(points, 1, pose, table, (J, r, places))
    return np.sum(np.abs(r[:n]) < c) / max(len(points), 1)


@njit
def residuals(points: Floats, stride: int, pose: Floats, table: Table, found: tuple[Floats, Floats, Floats]) -> int:
    """Write derivative (M, 3), distance (M,) and place (M, 2) of the points that lie in the table; returns how many."""
    patches, cell = table
    J, r, places = found
    height, width = patches.shape[0], patches.shape[1]
    cos, sin, n = np.cos(pose[2]), np.sin(pose[2]), 0
    for i in range(0, len(points), stride):
        rx, ry = cos * points[i, 0] - sin * points[i, 1], sin * points[i, 0] + cos * points[i, 1]
        u, v = (rx + pose[0]) / cell, (ry + pose[1]) / cell
        if not (u >= 0.0 and v >= 0.0 and u < width and v < height):
            continue
        col, row = int(u), int(v)
        p0, p1, p2, p3 = patches[row, col]
        a, b = u - col, v - row
        dx, dy = (p1 + p3 * b) / cell, (p2 + p3 * a) / cell
        J[n, 0], J[n, 1], J[n, 2] = dx, dy, dy * rx - dx * ry
        r[n] = p0 + p1 * a + (p2 + p3 * a) * b
        places[n, 0], places[n, 1] = rx + pose[0], ry + pose[1]
        n += 1
    return n
