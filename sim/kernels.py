"""The twin's Numba kernels. A row is one physics step: pose of `base` (x y z, quaternion x y z w), two wheel angles, poses of bodies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Vector = tuple[float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]


@njit
def to_base(rows: Floats, t: Floats, q: Floats) -> Floats:
    """Turn the leading poses of `rows` (K, >= 7) from frame c into frame b in place; returns x, y, yaw (K, 3).

    Args:
        rows: T_world_c in the first seven columns.
        t: (3,) translation of T_c_b [m].
        q: (4,) quaternion of T_c_b.
    """
    planar = np.empty((len(rows), 3))
    for k in range(len(rows)):
        row = rows[k]
        x, y, z, w = row[3], row[4], row[5], row[6]
        R = _rotation(x, y, z, w)
        for i in range(3):
            row[i] += R[3 * i] * t[0] + R[3 * i + 1] * t[1] + R[3 * i + 2] * t[2]
        row[3] = w * q[0] + x * q[3] + y * q[2] - z * q[1]
        row[4] = w * q[1] - x * q[2] + y * q[3] + z * q[0]
        row[5] = w * q[2] + x * q[1] - y * q[0] + z * q[3]
        row[6] = w * q[3] - x * q[0] - y * q[1] - z * q[2]
        B = _rotation(row[3], row[4], row[5], row[6])
        planar[k, 0], planar[k, 1], planar[k, 2] = row[0], row[1], np.arctan2(B[3], B[0])
    return planar


@njit
def beams(
    rows: Floats, clock: tuple[float, float], times: tuple[float, float], directions: Floats, mount: Floats
) -> tuple[Singles, Singles]:
    """Origins and directions (N, 3) in the world of beams that leave a moving base one after the other.

    Args:
        rows: (K, >= 7) physics steps.
        clock: time of the first row and time from row to row [s].
        times: time of the first beam and time from beam to beam [s].
        directions: (N, 3) unit vectors in base axes.
        mount: (3,) origin of the beams in base [m].
    """
    origins = np.empty(directions.shape, np.float32)
    turned = np.empty(directions.shape, np.float32)
    for i in range(len(directions)):
        p, R = _pose_at(rows, clock, times[0] + i * times[1], 0)
        for j in range(3):
            a, b, c = R[3 * j], R[3 * j + 1], R[3 * j + 2]
            origins[i, j] = p[j] + a * mount[0] + b * mount[1] + c * mount[2]
            turned[i, j] = a * directions[i, 0] + b * directions[i, 1] + c * directions[i, 2]
    return origins, turned


@njit
def beams_at_body(
    rows: Floats,
    clock: tuple[float, float],
    times: tuple[float, float],
    body: tuple[int, float],
    rays: tuple[Singles, Singles, Singles],
) -> tuple[NDArray[np.int64], Singles, Singles]:
    """Which beams may hit a moving body: their indices (M,), origins and directions (M, 3) in the body's frame at each beam's time.

    Args:
        rows: (K, >= column + 7) physics steps.
        clock: time of the first row and time from row to row [s].
        times: time of the first beam and time from beam to beam [s].
        body: first column of the body's pose, and the radius of a sphere about its origin that holds it [m].
        rays: origins (N, 3), directions (N, 3) in the world and what they have hit so far (N,) [m].
    """
    column, radius = body
    origins, directions, ranges = rays
    indices = np.empty(len(origins), np.int64)
    local_origins, local_directions = np.empty_like(origins), np.empty_like(directions)
    count = 0
    for i in range(len(origins)):
        p, R = _pose_at(rows, clock, times[0] + i * times[1], column)
        o = origins[i, 0] - p[0], origins[i, 1] - p[1], origins[i, 2] - p[2]
        d = directions[i, 0], directions[i, 1], directions[i, 2]
        along = -(o[0] * d[0] + o[1] * d[1] + o[2] * d[2])
        aside = o[0] * o[0] + o[1] * o[1] + o[2] * o[2] - along * along
        if along < -radius or along - radius > ranges[i] or aside > radius * radius:
            continue
        indices[count] = i
        for j in range(3):
            local_origins[count, j] = R[j] * o[0] + R[3 + j] * o[1] + R[6 + j] * o[2]
            local_directions[count, j] = R[j] * d[0] + R[3 + j] * d[1] + R[6 + j] * d[2]
        count += 1
    return indices[:count], local_origins[:count], local_directions[:count]


@njit
def measure(ranges: Singles, normals: Floats, sigmas: tuple[float, float], resolution: float, limits: tuple[float, float]) -> Floats:
    """What a lidar reports (N,) [m] of true ranges: noise of max(sigmas[0], sigmas[1] r), rounding, and REP 117 outside the limits."""
    reported = np.empty(len(ranges))
    for i in range(len(ranges)):
        r = float(ranges[i])
        if np.isfinite(r):
            r += normals[i] * max(sigmas[0], sigmas[1] * r)
            r = np.rint(r / resolution) * resolution
        if r < limits[0]:
            r = -np.inf
        elif r > limits[1]:
            r = np.inf
        reported[i] = r
    return reported


@njit
def _pose_at(rows: Floats, clock: tuple[float, float], t: float, column: int) -> tuple[Vector, Matrix]:
    """Position and rotation (row-major, nine numbers) at `t` of the pose that starts in `column`, linear between rows."""
    place = min(max((t - clock[0]) / clock[1], 0.0), len(rows) - 1.0)
    k = min(int(place), max(len(rows) - 2, 0))
    a, b = rows[k, column : column + 7], rows[min(k + 1, len(rows) - 1), column : column + 7]
    f = place - k
    g = f if a[3] * b[3] + a[4] * b[4] + a[5] * b[5] + a[6] * b[6] >= 0.0 else -f
    p = a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1]), a[2] + f * (b[2] - a[2])
    x, y = (1.0 - f) * a[3] + g * b[3], (1.0 - f) * a[4] + g * b[4]
    z, w = (1.0 - f) * a[5] + g * b[5], (1.0 - f) * a[6] + g * b[6]
    n = 1.0 / np.sqrt(x * x + y * y + z * z + w * w)
    return p, _rotation(x * n, y * n, z * n, w * n)


@njit
def _rotation(x: float, y: float, z: float, w: float) -> Matrix:
    """Rotation matrix of a unit quaternion, nine numbers row by row."""
    return (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - z * w),
        2.0 * (x * z + y * w),
        2.0 * (x * y + z * w),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - x * w),
        2.0 * (x * z - y * w),
        2.0 * (y * z + x * w),
        1.0 - 2.0 * (x * x + y * y),
    )
