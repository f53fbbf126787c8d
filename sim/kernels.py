"""The twin's Numba kernels: poses of the physics steps, and the beams of a lidar that moves with them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Place = tuple[float, float, float]
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
    mx, my, mz = mount
    last = len(frames) - 2
    i = 0
    for k in range(last + 1):  # frame by frame: what is interpolated between stays in registers
        before, after = _numbers(frames, k), _numbers(frames, k + 1)
        end = np.inf if k == last else k + 1.0
        while i < len(directions) and times[0] + i * times[1] < end:
            f = min(max(times[0] + i * times[1] - k, 0.0), 1.0)
            dx, dy, dz = directions[i, 0], directions[i, 1], directions[i, 2]
            for j in range(3):
                a = before[3 * j] + f * (after[3 * j] - before[3 * j])
                b = before[3 * j + 1] + f * (after[3 * j + 1] - before[3 * j + 1])
                c = before[3 * j + 2] + f * (after[3 * j + 2] - before[3 * j + 2])
                p = before[9 + j] + f * (after[9 + j] - before[9 + j])
                origins[i, j] = p + a * mx + b * my + c * mz
                turned[i, j] = a * dx + b * dy + c * dz
            i += 1
    return origins, turned


@njit
def _numbers(frames: Floats, k: int) -> tuple[float, ...]:
    """The twelve numbers of one frame."""
    f = frames[k]
    return f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8], f[9], f[10], f[11]


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
