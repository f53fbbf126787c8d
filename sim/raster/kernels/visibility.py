"""Which face each pixel sees.

Inside and depth are linear in a pixel's ray (see `faces`), so no face need be clipped, the rays may be those of any lens, and each row
may have a camera pose of its own.
"""

from __future__ import annotations

import numpy as np

from sim.raster.kernels.faces import BLOCK, COUNT, DISTANCE, EDGES, Ids, Shapes, Singles, W, begin_block, in_camera
from sim.raster.kernels.views import Floats, Views
from slam.kernels.jit import njit

Rays = tuple[Singles, Singles, Floats]
"""x and y (H, W) of each pixel's ray at z = 1, lowest and highest y of each row (H, 2)."""

NEAR = 0.01
"""What is nearer than this to the camera's plane [m] is taken to reach it."""
FAR_AWAY = 1e9


@njit
def see(shapes: Shapes, views: Views, rays: Rays) -> Ids:
    """Index of the nearest face along each pixel's ray (H, W); -1 where there is none."""
    corners, planes, body, lift = shapes
    R, o = views
    x, y, y_spans = rays
    nearest, ids = np.zeros(x.shape, np.float32), np.full(x.shape, -1, np.int32)
    c, slope, rolls = np.zeros(COUNT), np.zeros(COUNT), R.shape[1] > 1
    first, last = np.ascontiguousarray(y_spans[:, 0]), np.ascontiguousarray(y_spans[:, 1])
    sides = float(x[:, 0].min()), float(x[:, -1].max())
    for f in range(len(corners)):
        b = body[f]
        low, high = _extent(corners, planes, f, R, o, b, sides)
        if low > high:
            continue
        top, bottom = np.searchsorted(last, low), np.searchsorted(first, high, side="right")
        for row in range(top, bottom):
            if row == top or (rolls and row % BLOCK == 0):
                begin_block(corners[f], planes[f], R[b], o[b], row, c, slope)
            elif rolls:
                for i in range(COUNT - 1):
                    c[i] += slope[i]
            if c[DISTANCE] < 0.0:
                begin, end = _columns(c, y_spans[row, 0], y_spans[row, 1], x, row)
                _fill(x, y, row, begin, end, c, lift[f], f, nearest, ids)
    return ids


@njit
def _fill(x: Singles, y: Singles, row: int, begin: int, end: int, c: Floats, lifting: float, face: int, nearest: Singles, ids: Ids) -> None:
    wx, wy, w1 = np.float32(c[W] * lifting), np.float32(c[W + 1] * lifting), np.float32(c[W + 2] * lifting)
    ax, ay, a1 = np.float32(c[EDGES]), np.float32(c[EDGES + 1]), np.float32(c[EDGES + 2])
    bx, by, b1 = np.float32(c[EDGES + 3]), np.float32(c[EDGES + 4]), np.float32(c[EDGES + 5])
    cx, cy, c1 = np.float32(c[EDGES + 6]), np.float32(c[EDGES + 7]), np.float32(c[EDGES + 8])
    dx, dy, d1 = np.float32(c[EDGES + 9]), np.float32(c[EDGES + 10]), np.float32(c[EDGES + 11])
    index, zero, r = np.int32(face), np.float32(0.0), np.uint64(row)
    for i in range(np.uint64(begin), np.uint64(end)):  # unsigned, or every index is asked whether it is below 0
        u, v = x[r, i], y[r, i]
        w = wx * u + wy * v + w1
        inside = (ax * u + ay * v + a1 >= zero) & (bx * u + by * v + b1 >= zero)
        inside &= (cx * u + cy * v + c1 >= zero) & (dx * u + dy * v + d1 >= zero)
        inside &= w > nearest[r, i]
        nearest[r, i] = w if inside else nearest[r, i]
        ids[r, i] = index if inside else ids[r, i]


@njit
def _extent(corners: Floats, planes: Floats, f: int, R: Floats, o: Floats, b: int, sides: tuple[float, float]) -> tuple[float, float]:
    """Lowest and highest y at z = 1 that a face may be seen at; the first above the other where it cannot be seen."""
    low, high, left, right, count = FAR_AWAY, -FAR_AWAY, FAR_AWAY, -FAR_AWAY, R.shape[1]
    step = max((count - 1) // 2, 1)
    for k in range(0, count, step):
        if planes[f, 0] * o[b, k, 0] + planes[f, 1] * o[b, k, 1] + planes[f, 2] * o[b, k, 2] <= planes[f, 3]:
            continue
        four, axes, eye = corners[f], R[b, k], o[b, k]  # each of these costs as much as a corner
        bx, by, bz = in_camera(four, 3, axes, eye)
        for i in range(4):
            ax, ay, az = bx, by, bz
            bx, by, bz = in_camera(four, i, axes, eye)
            if bz >= NEAR:
                x, y = bx / bz, by / bz
                low, high, left, right = min(low, y), max(high, y), min(left, x), max(right, x)
            if (az >= NEAR) != (bz >= NEAR):
                share = (NEAR - az) / (bz - az)
                x, y = (ax + share * (bx - ax)) / NEAR, (ay + share * (by - ay)) / NEAR
                low, high, left, right = min(low, y), max(high, y), min(left, x), max(right, x)
    slack = 1e-5 if count == 1 else 0.005 + 0.02 * max(high - low, right - left)  # between the rows that were looked at
    if left - slack > sides[1] or right + slack < sides[0]:
        return FAR_AWAY, -FAR_AWAY
    return low - slack, high + slack


@njit
def _columns(c: Floats, y_low: float, y_high: float, x: Singles, row: int) -> tuple[int, int]:
    """Pixels of a row, of rising x and of y between two bounds, that may be inside all edges: first, and one after the last."""
    low, high = -FAR_AWAY, FAR_AWAY
    for i in range(4):
        a, b = c[EDGES + 3 * i], c[EDGES + 3 * i + 1]
        most = max(b * y_low, b * y_high) + c[EDGES + 3 * i + 2]
        if a > 0.0:
            low = max(low, -most / a)
        elif a < 0.0:
            high = min(high, -most / a)
        elif most < 0.0:
            return 0, 0
    last = x.shape[1] - 1
    if low > high or low > x[row, last] or high < x[row, 0]:
        return 0, 0
    return max(_first_at_least(x, row, low) - 1, 0), _first_at_least(x, row, high) + 1  # float32 rounds the rays


@njit
def _first_at_least(x: Singles, row: int, value: float) -> int:
    """First pixel of a row whose x is at least `value`, or its last one."""
    last = x.shape[1] - 1
    share = (value - x[row, 0]) / (x[row, last] - x[row, 0])
    i = int(min(max(share, 0.0), 1.0) * last)
    while i < last and x[row, i] < value:
        i += 1
    while i > 0 and x[row, i - 1] >= value:
        i -= 1
    return i
