"""Gauss-Newton registration of points on the nearest-surface field."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.surfaces import FLATNESS, NORMAL_X, NORMAL_Y, ONE_SIDED, X, Y

Field = tuple[NDArray[np.int32], NDArray[np.float32], float]
"""Nearest occupied flat cell (H, W), its surfaces (H, W, 5), cell size [m]."""


@njit
def match(
    points: NDArray[np.float64],
    start: NDArray[np.float64],
    prior: tuple[NDArray[np.float64], NDArray[np.float64]],
    field: Field,
    settings: tuple[int, float, float, float, float, float],
    noise: tuple[float, float],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float, bool, int]:
    """Minimise sum rho(d(T p_i)) / variance + prior over the pose; d is the distance to the nearest surface.

    Args:
        points: (M, 2) [m] in base.
        start: (3,) x, y, yaw in the grid's frame.
        prior: mean (3,) in the grid's frame and covariance (3, 3).
        field: the map's surfaces.
        settings: most iterations, first and last kernel width [m], step below which it has converged [m or rad],
            share of the kernel width kept each iteration, weight of a lone point against a line.
        noise: least standard deviation of a residual [m], residuals that count as one independent.

    Returns:
        pose (3,), its covariance (3, 3), RMS residual [m], share of points within the last kernel of a surface, converged, iterations.
    """
    iterations, kernel, kernel_last, tolerance, shrink, lone = settings
    variance = noise[0] * noise[0] * noise[1]
    mean, information = prior[0], inverse(prior[1]) * variance
    pose = start.copy()
    H, g = np.zeros((3, 3)), np.zeros(3)
    rms, share, converged, n = 0.0, 0.0, False, 0
    for _ in range(iterations):
        n += 1
        rms, share = _accumulate(points, pose, field, (kernel, lone), H, g)
        S = inverse(H + information)
        for i in range(3):
            for j in range(3):
                g[i] += information[i, j] * (pose[j] - mean[j])
        largest = 0.0
        for i in range(3):
            step = S[i, 0] * g[0] + S[i, 1] * g[1] + S[i, 2] * g[2]
            pose[i] -= step
            largest = max(largest, abs(step))
        # a point that hops between two surfaces keeps the last steps above the tolerance, but below 2 mm
        converged = largest < 20.0 * tolerance
        if kernel == kernel_last and largest < tolerance:
            break
        kernel = max(kernel_last, shrink * kernel)
    scale = max(rms / noise[0], 1.0) ** 2
    return pose, inverse(H / scale + information) * variance, rms, share, converged, n


@njit
def match_in_map(
    points: NDArray[np.float64],
    start: NDArray[np.float64],
    prior: tuple[NDArray[np.float64], NDArray[np.float64]],
    frame: NDArray[np.float64],
    field: Field,
    settings: tuple[int, float, float, float, float, float],
    noise: tuple[float, float],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float, bool, int]:
    """`match` with start, prior and answer in the map; `frame` (3,) is T_map_grid."""
    mean = _to_grid(prior[0], frame)
    begin = _to_grid(start, frame)
    mean[2] = begin[2] + np.arctan2(np.sin(mean[2] - begin[2]), np.cos(mean[2] - begin[2]))
    covariance = _turned(prior[1], -frame[2])
    pose, covariance, rms, share, converged, n = match(points, begin, (mean, covariance), field, settings, noise)
    c, s = np.cos(frame[2]), np.sin(frame[2])
    x, y = pose[0], pose[1]
    pose[0], pose[1], pose[2] = frame[0] + c * x - s * y, frame[1] + s * x + c * y, frame[2] + pose[2]
    return pose, _turned(covariance, frame[2]), rms, share, converged, n


@njit
def _to_grid(pose: NDArray[np.float64], frame: NDArray[np.float64]) -> NDArray[np.float64]:
    """A pose (3,) of the map in the grid's frame."""
    c, s = np.cos(frame[2]), np.sin(frame[2])
    dx, dy = pose[0] - frame[0], pose[1] - frame[1]
    return np.array([c * dx + s * dy, c * dy - s * dx, pose[2] - frame[2]])


@njit
def _turned(covariance: NDArray[np.float64], yaw: float) -> NDArray[np.float64]:
    """R covariance R^T with the rotation R of the plane by `yaw`."""
    c, s = np.cos(yaw), np.sin(yaw)
    half = np.empty((3, 3))
    for j in range(3):
        half[0, j] = c * covariance[0, j] - s * covariance[1, j]
        half[1, j] = s * covariance[0, j] + c * covariance[1, j]
        half[2, j] = covariance[2, j]
    turned = np.empty((3, 3))
    for i in range(3):
        turned[i, 0] = c * half[i, 0] - s * half[i, 1]
        turned[i, 1] = s * half[i, 0] + c * half[i, 1]
        turned[i, 2] = half[i, 2]
    return turned


@njit
def _accumulate(
    points: NDArray[np.float64],
    pose: NDArray[np.float64],
    field: Field,
    kernel: tuple[float, float],
    H: NDArray[np.float64],
    g: NDArray[np.float64],
) -> tuple[float, float]:
    """Normal equations of all points: writes H = sum w J^T J, g = sum w J^T d; returns RMS residual, share of points within the kernel."""
    nearest, surfaces, resolution = field
    height, width = nearest.shape
    flat = surfaces.reshape(-1)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    k2, scale = kernel[0] * kernel[0], 1.0 / resolution
    h00 = h01 = h02 = h11 = h12 = h22 = g0 = g1 = g2 = 0.0
    total, squares, found = 0.0, 0.0, 0
    for i in range(len(points)):
        rx = c * points[i, 0] - s * points[i, 1]
        ry = s * points[i, 0] + c * points[i, 1]
        x, y = rx + pose[0], ry + pose[1]
        if not (x >= 0.0 and y >= 0.0):
            continue
        col, row = int(x * scale), int(y * scale)
        if row >= height or col >= width:
            continue
        index = 5 * nearest[row, col]
        if index < 0:
            continue
        dx, dy = x - flat[index + X], y - flat[index + Y]
        if flat[index + FLATNESS] > 0.0:
            nx, ny = flat[index + NORMAL_X], flat[index + NORMAL_Y]
            d = nx * dx + ny * dy
            found += d * d < k2
            if flat[index + FLATNESS] == ONE_SIDED and nx * rx + ny * ry > 0.0:
                continue  # the other face of this wall
            w = k2 / (k2 + d * d)
            w *= w  # Geman-McClure
            turn = ny * rx - nx * ry
            h00 += w * nx * nx
            h01 += w * nx * ny
            h11 += w * ny * ny
            h02 += w * nx * turn
            h12 += w * ny * turn
            h22 += w * turn * turn
            g0 += w * nx * d
            g1 += w * ny * d
            g2 += w * turn * d
            total += w
            squares += w * d * d
        else:
            d2 = dx * dx + dy * dy
            found += d2 < k2
            w = k2 / (k2 + d2)
            w *= w * kernel[1]
            h00 += w
            h11 += w
            h02 -= w * ry
            h12 += w * rx
            h22 += w * (rx * rx + ry * ry)
            g0 += w * dx
            g1 += w * dy
            g2 += w * (dy * rx - dx * ry)
    H[0, 0], H[0, 1], H[0, 2] = h00, h01, h02
    H[1, 0], H[1, 1], H[1, 2] = h01, h11, h12
    H[2, 0], H[2, 1], H[2, 2] = h02, h12, h22
    g[0], g[1], g[2] = g0, g1, g2
    rms = np.sqrt(squares / total) if total > 0.0 else 0.0
    return rms, found / max(len(points), 1)


@njit
def inverse(A: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a symmetric positive definite 3 x 3 matrix by its adjugate; nan where it is singular."""
    B = np.empty((3, 3))
    B[0, 0] = A[1, 1] * A[2, 2] - A[1, 2] * A[1, 2]
    B[0, 1] = A[0, 2] * A[1, 2] - A[0, 1] * A[2, 2]
    B[0, 2] = A[0, 1] * A[1, 2] - A[0, 2] * A[1, 1]
    B[1, 1] = A[0, 0] * A[2, 2] - A[0, 2] * A[0, 2]
    B[1, 2] = A[0, 1] * A[0, 2] - A[0, 0] * A[1, 2]
    B[2, 2] = A[0, 0] * A[1, 1] - A[0, 1] * A[0, 1]
    B[1, 0], B[2, 0], B[2, 1] = B[0, 1], B[0, 2], B[1, 2]
    det = A[0, 0] * B[0, 0] + A[0, 1] * B[0, 1] + A[0, 2] * B[0, 2]
    return B / det if det > 0.0 else np.full((3, 3), np.nan)
