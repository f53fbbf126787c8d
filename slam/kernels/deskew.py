"""Beams to points, each from the pose at its own time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.rays import direction


@njit
def deskew(
    ranges: NDArray[np.float64],
    angles: NDArray[np.float64],
    limits: tuple[float, float],
    times: tuple[float, float],
    samples: tuple[NDArray[np.float64], NDArray[np.float64]],
    mount: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points and their origins (M, 2) [m] in base at the first beam's time.

    p_i = T_odom_base(t_0)^-1 T_odom_base(t_i) T_base_laser r_i; the origin is where the laser was at t_i.

    Args:
        ranges: (N,) [m]; beams that are not finite or outside `limits` are left out.
        angles: (N,) of the beams in the laser's frame [rad].
        limits: nearest and farthest range to use [m].
        times: time of the first beam and time from beam to beam [s].
        samples: stamps (K,) [s] and poses (K, 3) of T_odom_base; linear between, the short way round, held beyond the ends.
        mount: rotation (3, 3) and position (3,) of the laser in base [m].
    """
    stamps, poses = samples
    R, laser = mount
    points, origins = np.empty((len(ranges), 2)), np.empty((len(ranges), 2))
    count, k = 0, 0
    t0, dt = times
    x0, y0, yaw0 = _pose_at(t0, stamps, poses, 0)
    c0, s0 = direction(yaw0)
    for i in range(len(ranges)):
        r = ranges[i]
        if not (np.isfinite(r) and limits[0] <= r <= limits[1]):
            continue
        t = t0 + i * dt
        while k + 2 < len(stamps) and stamps[k + 1] < t:
            k += 1
        x, y, yaw = _pose_at(t, stamps, poses, k)
        dx, dy = c0 * (x - x0) + s0 * (y - y0), c0 * (y - y0) - s0 * (x - x0)
        c, s = direction(yaw - yaw0)
        origins[count, 0] = dx + c * laser[0] - s * laser[1]
        origins[count, 1] = dy + s * laser[0] + c * laser[1]
        along, across = direction(angles[i])
        bx, by = r * (along * R[0, 0] + across * R[0, 1]), r * (along * R[1, 0] + across * R[1, 1])
        points[count, 0] = origins[count, 0] + c * bx - s * by
        points[count, 1] = origins[count, 1] + s * bx + c * by
        count += 1
    return points[:count].copy(), origins[:count].copy()


@njit
def _pose_at(t: float, stamps: NDArray[np.float64], poses: NDArray[np.float64], k: int) -> tuple[float, float, float]:
    """Pose at `t` between samples, searching forward from sample `k`."""
    n = len(stamps)
    if n == 0:
        return 0.0, 0.0, 0.0
    while k + 2 < n and stamps[k + 1] < t:
        k += 1
    if n == 1 or t <= stamps[k]:
        return poses[k, 0], poses[k, 1], poses[k, 2]
    span = stamps[k + 1] - stamps[k]
    f = min((t - stamps[k]) / span, 1.0) if span > 0.0 else 1.0
    a, b = poses[k], poses[k + 1]
    turn = b[2] - a[2]
    turn -= 2.0 * np.pi * np.floor(turn / (2.0 * np.pi) + 0.5)
    return a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1]), a[2] + f * turn
