"""A rolling shutter reads the rows of an image one after the other: what it saw of squares, as if it had been read at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]


@njit
def read_at_once(rays: Floats, poses: tuple[Floats, Floats], mount: tuple[Floats, Floats], twist: Floats, delays: Floats) -> Floats:
    """Rays (N, 4, 2) as the camera would have seen the corners of squares `delays` earlier; as they are where a pose is nan.

    Args:
        rays: (N, 4, 2) as seen.
        poses: rotations (N, 3, 3) and translations (N, 3) [m] of camera from square, for the corners' depths.
        mount: rotation and translation [m] of base from camera.
        twist: (3,) of base in base: v_x, v_y [m/s], omega [rad/s].
        delays: (N, 4) after the time that is wanted [s].
    """
    R, t = poses
    B, b = mount
    moved, p, q = rays.copy(), np.empty(3), np.empty(3)
    for n in range(len(rays)):
        if np.isnan(t[n, 2]):
            continue
        normal = R[n, 0, 2] * t[n, 0] + R[n, 1, 2] * t[n, 1] + R[n, 2, 2] * t[n, 2]
        for k in range(4):
            x, y = rays[n, k]
            slant = R[n, 0, 2] * x + R[n, 1, 2] * y + R[n, 2, 2]
            depth = normal / slant if abs(slant) > 1e-6 and normal / slant > 0.0 else t[n, 2]
            for i in range(3):
                p[i] = (B[i, 0] * x + B[i, 1] * y + B[i, 2]) * depth + b[i]
            angle = twist[2] * delays[n, k]
            c, s = np.cos(angle), np.sin(angle)
            vx, vy = twist[0] * delays[n, k], twist[1] * delays[n, k]
            p[0], p[1] = c * p[0] - s * p[1] + vx - 0.5 * angle * vy, s * p[0] + c * p[1] + vy + 0.5 * angle * vx
            for i in range(3):
                q[i] = B[0, i] * (p[0] - b[0]) + B[1, i] * (p[1] - b[1]) + B[2, i] * (p[2] - b[2])
            moved[n, k] = q[0] / q[2], q[1] / q[2]
    return moved
