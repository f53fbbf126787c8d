"""The twin's Numba kernels: poses of the physics steps, and the beams of a lidar that moves with them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
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
def beams(frames: Floats, times: tuple[float, float], directions: Floats, mount: Floats) -> tuple[Singles, Singles]:
    """Origins and directions (N, 3) in the world of beams that leave a moving base one after the other.

    Args:
        frames: (K, 12) of base, see `frames_of`.
        times: place of the first beam among the frames and from beam to beam.
        directions: (N, 3) unit vectors in base axes.
        mount: (3,) origin of the beams in base [m].
    """
    origins = np.empty(directions.shape, np.float32)
    turned = np.empty(directions.shape, np.float32)
    for i in range(len(directions)):
        place = min(max(times[0] + i * times[1], 0.0), len(frames) - 1.0)
        k = min(int(place), len(frames) - 2)
        f, before, after = place - k, frames[k], frames[k + 1]
        for j in range(3):
            a = before[3 * j] + f * (after[3 * j] - before[3 * j])
            b = before[3 * j + 1] + f * (after[3 * j + 1] - before[3 * j + 1])
            c = before[3 * j + 2] + f * (after[3 * j + 2] - before[3 * j + 2])
            p = before[9 + j] + f * (after[9 + j] - before[9 + j])
            origins[i, j] = p + a * mount[0] + b * mount[1] + c * mount[2]
            turned[i, j] = a * directions[i, 0] + b * directions[i, 1] + c * directions[i, 2]
    return origins, turned


@njit
def beams_at_body(
    frames: Floats, times: tuple[float, float], radius: float, rays: tuple[Singles, Singles, Singles]
) -> tuple[NDArray[np.int64], Singles, Singles]:
    """Which beams may hit a moving body: their indices (M,), origins and directions (M, 3) in the body's frame at each beam's time.

    Args:
        frames: (K, 12) of the body, see `frames_of`.
        times: place of the first beam among the frames and from beam to beam.
        radius: of a sphere about the body's origin that holds it [m].
        rays: origins (N, 3), directions (N, 3) in the world and what they have hit so far (N,) [m].
    """
    origins, directions, ranges = rays
    indices = np.empty(len(origins), np.int64)
    local_origins, local_directions = np.empty_like(origins), np.empty_like(directions)
    x, y, z = frames[0, 9], frames[0, 10], frames[0, 11]
    reach = radius  # of a sphere about the first position that holds the body all the time
    for k in range(1, len(frames)):
        away = np.sqrt((frames[k, 9] - x) ** 2 + (frames[k, 10] - y) ** 2 + (frames[k, 11] - z) ** 2)
        reach = max(reach, radius + away)
    count = 0
    for i in range(len(origins)):
        ox, oy, oz = origins[i, 0] - x, origins[i, 1] - y, origins[i, 2] - z
        dx, dy, dz = directions[i, 0], directions[i, 1], directions[i, 2]
        along = -(ox * dx + oy * dy + oz * dz)
        aside = ox * ox + oy * oy + oz * oz - along * along
        if along < -reach or along > ranges[i] + reach or aside > reach * reach:
            continue
        place = min(max(times[0] + i * times[1], 0.0), len(frames) - 1.0)
        k = min(int(place), len(frames) - 2)
        frame = frames[k] + (place - k) * (frames[k + 1] - frames[k])
        ox, oy, oz = origins[i, 0] - frame[9], origins[i, 1] - frame[10], origins[i, 2] - frame[11]
        for j in range(3):
            local_origins[count, j] = frame[j] * ox + frame[3 + j] * oy + frame[6 + j] * oz
            local_directions[count, j] = frame[j] * dx + frame[3 + j] * dy + frame[6 + j] * dz
        indices[count] = i
        count += 1
    return indices[:count], local_origins[:count], local_directions[:count]


@njit
def frames_of(poses: Floats) -> Floats:
    """Rotation row by row and position, (K, 12), of poses x y z and quaternion x y z w (K, 7).

    Between two physics steps these twelve numbers are interpolated linearly: at 3 rad/s the rotation is off by 5e-6.
    """
    frames = np.empty((len(poses), 12))
    for k in range(len(poses)):
        frames[k, :9] = _rotation(poses[k, 3], poses[k, 4], poses[k, 5], poses[k, 6])
        frames[k, 9:] = poses[k, :3]
    return frames


@njit
def measure(ranges: Singles, normals: Floats, sigmas: tuple[float, float], steps: float, limits: tuple[float, float]) -> Floats:
    """What a lidar reports (N,) [m] of true ranges: noise of max(sigmas[0], sigmas[1] r), whole steps, REP 117 outside the limits."""
    reported = np.empty(len(ranges))
    for i in range(len(ranges)):
        r = float(ranges[i])
        if np.isfinite(r):
            r += normals[i] * max(sigmas[0], sigmas[1] * r)
            r = np.rint(r * steps) / steps
        if r < limits[0]:
            r = -np.inf
        elif r > limits[1]:
            r = np.inf
        reported[i] = r
    return reported


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
