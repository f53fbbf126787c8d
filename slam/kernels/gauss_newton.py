"""Gauss-Newton registration of points on the nearest-surface field."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.surfaces import FLATNESS, NORMAL_X, NORMAL_Y, X, Y


@njit
def match(
    points: NDArray[np.float64],
    pose: NDArray[np.float64],
    prior: NDArray[np.float64],
    field: tuple[NDArray[np.int32], NDArray[np.float32], float],
    settings: tuple[int, float, float, float, float, float],
) -> Any:
    """Minimise sum rho(d(T p_i)) + prior over the pose; d is the distance to the nearest surface.

    Args:
        points: (M, 2) [m] in base.
        pose: (3,) start x, y, yaw in the grid's frame; also the prior's mean. Not written.
        prior: (3, 3) information of the prior, in units of one residual's variance.
        field: nearest occupied flat cell (H, W), its surfaces (H, W, 5), cell size [m].
        settings: most iterations, first and smallest kernel width [m], step below which it has converged [m or rad],
            share of the kernel width kept each iteration, weight of a lone point against a line.

    Returns:
        pose (3,), information of the points alone (3, 3), RMS residual [m], share of points with a surface, converged.
    """
    nearest, surfaces, resolution = field
    height, width = nearest.shape
    flat = surfaces.reshape(-1, 5)
    iterations, kernel, floor, tolerance, shrink, lone = settings
    guess = pose.copy()
    pose = pose.copy()
    A = np.zeros((3, 3))
    rms, share, converged = 0.0, 0.0, False
    for _ in range(iterations):
        c, s = np.cos(pose[2]), np.sin(pose[2])
        h00 = h01 = h02 = h11 = h12 = h22 = b0 = b1 = b2 = 0.0
        total, squares, found = 0.0, 0.0, 0
        k2 = kernel * kernel
        for i in range(len(points)):
            px, py = points[i, 0], points[i, 1]
            rx, ry = c * px - s * py, s * px + c * py
            x, y = rx + pose[0], ry + pose[1]
            col, row = int(np.floor(x / resolution)), int(np.floor(y / resolution))
            if not (0 <= row < height and 0 <= col < width):
                continue
            index = nearest[row, col]
            if index < 0:
                continue
            found += 1
            dx, dy = x - flat[index, X], y - flat[index, Y]
            if flat[index, FLATNESS] > 0.0:
                nx, ny = flat[index, NORMAL_X], flat[index, NORMAL_Y]
                d = nx * dx + ny * dy
                w = k2 / (k2 + d * d)
                w *= w  # Geman-McClure
                j2 = ny * rx - nx * ry
                h00 += w * nx * nx
                h01 += w * nx * ny
                h11 += w * ny * ny
                h02 += w * nx * j2
                h12 += w * ny * j2
                h22 += w * j2 * j2
                b0 += w * nx * d
                b1 += w * ny * d
                b2 += w * j2 * d
                total += w
                squares += w * d * d
            else:
                d2 = dx * dx + dy * dy
                w = k2 / (k2 + d2)
                w *= w * lone
                h00 += w
                h11 += w
                h02 -= w * ry
                h12 += w * rx
                h22 += w * (rx * rx + ry * ry)
                b0 += w * dx
                b1 += w * dy
                b2 += w * (dy * rx - dx * ry)
        A[0, 0], A[0, 1], A[0, 2] = h00, h01, h02
        A[1, 0], A[1, 1], A[1, 2] = h01, h11, h12
        A[2, 0], A[2, 1], A[2, 2] = h02, h12, h22
        rms = np.sqrt(squares / total) if total > 0.0 else 0.0
        share = found / len(points) if len(points) > 0 else 0.0
        e0, e1, e2 = pose[0] - guess[0], pose[1] - guess[1], pose[2] - guess[2]
        g0 = b0 + prior[0, 0] * e0 + prior[0, 1] * e1 + prior[0, 2] * e2
        g1 = b1 + prior[1, 0] * e0 + prior[1, 1] * e1 + prior[1, 2] * e2
        g2 = b2 + prior[2, 0] * e0 + prior[2, 1] * e1 + prior[2, 2] * e2
        s0, s1, s2, regular = _solve(A + prior, g0, g1, g2)
        if not regular:
            converged = False
            break
        pose[0] -= s0
        pose[1] -= s1
        pose[2] -= s2
        step = max(abs(s0), abs(s1), abs(s2))
        target = max(floor, 0.0 * rms)
        settled = kernel <= 1.01 * target
        kernel = max(target, shrink * kernel)
        converged = step < 20.0 * tolerance
        if settled and step < tolerance:
            break
    return pose, A, rms, share, converged


@njit
def _solve(H: NDArray[np.float64], g0: float, g1: float, g2: float) -> Any:
    """Solve the symmetric 3 x 3 system by its adjugate; False when it is singular."""
    c00 = H[1, 1] * H[2, 2] - H[1, 2] * H[1, 2]
    c01 = H[0, 2] * H[1, 2] - H[0, 1] * H[2, 2]
    c02 = H[0, 1] * H[1, 2] - H[0, 2] * H[1, 1]
    det = H[0, 0] * c00 + H[0, 1] * c01 + H[0, 2] * c02
    if not det > 1e-9:
        return 0.0, 0.0, 0.0, False
    c11 = H[0, 0] * H[2, 2] - H[0, 2] * H[0, 2]
    c12 = H[0, 1] * H[0, 2] - H[0, 0] * H[1, 2]
    c22 = H[0, 0] * H[1, 1] - H[0, 1] * H[0, 1]
    s0 = (c00 * g0 + c01 * g1 + c02 * g2) / det
    s1 = (c01 * g0 + c11 * g1 + c12 * g2) / det
    s2 = (c02 * g0 + c12 * g1 + c22 * g2) / det
    return s0, s1, s2, True
