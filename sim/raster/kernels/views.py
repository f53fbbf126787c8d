"""Where the camera is, seen from every body, row by row of a picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Views = tuple[Floats, Floats]
"""`R` (B, K, 3, 3), body axes to camera axes, and `o` (B, K, 3), the camera in the body [m]: B bodies, K rows or 1 for them all."""


@njit
def views_from(camera: Floats, bodies: Floats) -> tuple[Floats, Floats]:
    """`Views` of the world, which is body 0, and of B - 1 bodies.

    Args:
        camera: (K, 12) of T_world_camera, rotation row by row and position.
        bodies: (B - 1, K, 12) of T_world_body.
    """
    count = len(camera)
    R, o = np.empty((len(bodies) + 1, count, 3, 3)), np.empty((len(bodies) + 1, count, 3))
    for k in range(count):
        for i in range(3):
            o[0, k, i] = camera[k, 9 + i]
            for j in range(3):
                R[0, k, i, j] = camera[k, 3 * j + i]
        for b in range(len(bodies)):
            B = bodies[b, k]
            dx, dy, dz = camera[k, 9] - B[9], camera[k, 10] - B[10], camera[k, 11] - B[11]
            for i in range(3):
                o[b + 1, k, i] = B[i] * dx + B[3 + i] * dy + B[6 + i] * dz
                for j in range(3):
                    R[b + 1, k, i, j] = camera[k, i] * B[j] + camera[k, 3 + i] * B[3 + j] + camera[k, 6 + i] * B[6 + j]
    return R, o


@njit
def frames_at(values: Floats, places: Floats) -> Floats:
    """Frames (B, N, 12) between those given (B, K, 12), at places (N,) among them: 0 is the first, K - 1 the last."""
    result = np.empty((len(values), len(places), 12))
    last = values.shape[1] - 1
    for i in range(len(places)):
        place = min(max(places[i], 0.0), float(last))
        k = min(int(place), max(last - 1, 0))
        f, after = place - k, min(k + 1, last)
        for b in range(len(values)):
            for j in range(12):
                result[b, i, j] = values[b, k, j] + f * (values[b, after, j] - values[b, k, j])
    return result
