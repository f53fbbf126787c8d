"""Both poses that a square may have, from its four corners.

Collins, Bartoli, "Infinitesimal plane-based pose estimation" (2014): from the homography's slope at the square's middle follow two
rotations; each is then refined to the least reprojection error. A square's frame has x to the right, y up and z out of the print;
its corners are top left, top right, bottom right, bottom left.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.symmetric import solve

Floats = NDArray[np.float64]
ITERATIONS = 10
SETTLED = 1e-9
SIGNS = np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])
"""(4, 2) of the corners' x and y."""


@njit
def square_poses(rays: Floats, weights: Floats, sizes: Floats, iterations: int = ITERATIONS) -> tuple[Floats, Floats, Floats]:
    """Rotations (N, 2, 3, 3), translations (N, 2, 3) [m] of camera from square and chi-squares (N, 2), the better pose first.

    A pose that cannot be is nan with a chi-square of inf.

    Args:
        rays: (N, 4, 2) of the corners at z = 1.
        weights: (N, 4, 2, 2) inverse covariances of the rays.
        sizes: (N,) sides [m].
        iterations: steps of the refinement, at most; without any, a per cent or so is missing.
    """
    count = len(rays)
    R, t, chi = np.full((count, 2, 3, 3), np.nan), np.full((count, 2, 3), np.nan), np.full((count, 2), np.inf)
    for n in range(count):
        if not np.isfinite(rays[n]).all():
            continue
        half = 0.5 * sizes[n]
        if not _rotations(homography(rays[n], half), R[n]):
            continue
        for branch in range(2):
            _place(R[n, branch], rays[n], half, t[n, branch])
            chi[n, branch] = _refine((R[n, branch], t[n, branch]), rays[n], weights[n], half, iterations)
        if chi[n, 1] < chi[n, 0]:
            R[n], t[n], chi[n] = R[n, ::-1].copy(), t[n, ::-1].copy(), chi[n, ::-1].copy()
    return R, t, chi


@njit
def homography(rays: Floats, half: float) -> Floats:
    """From the square's plane [m] to rays: Heckbert, "Fundamentals of texture mapping" (1989), appendix A, on a centred square."""
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = rays[3], rays[2], rays[1], rays[0]  # (0, 0) (1, 0) (1, 1) (0, 1), y up
    sx, sy = x0 - x1 + x2 - x3, y0 - y1 + y2 - y3
    dx1, dx2, dy1, dy2 = x1 - x2, x3 - x2, y1 - y2, y3 - y2
    area = dx1 * dy2 - dx2 * dy1
    g, h = (sx * dy2 - dx2 * sy) / area, (dx1 * sy - sx * dy1) / area
    unit = np.array([[x1 - x0 + g * x1, x3 - x0 + h * x3, x0], [y1 - y0 + g * y1, y3 - y0 + h * y3, y0], [g, h, 1.0]])
    H = unit @ np.array([[0.5 / half, 0.0, 0.5], [0.0, 0.5 / half, 0.5], [0.0, 0.0, 1.0]])
    return H / H[2, 2]


@njit
def _rotations(H: Floats, R: Floats) -> bool:
    """Write the two rotations (2, 3, 3) of a homography; False when it is none."""
    p, q = H[0, 2], H[1, 2]
    J = np.array([[H[0, 0] - H[2, 0] * p, H[0, 1] - H[2, 1] * p], [H[1, 0] - H[2, 0] * q, H[1, 1] - H[2, 1] * q]])
    length = np.sqrt(p * p + q * q + 1.0)
    a, b, c = p / length, q / length, 1.0 / length
    k = 1.0 / (1.0 + c)
    Rv = np.array([[1.0 - k * a * a, -k * a * b, a], [-k * a * b, 1.0 - k * b * b, b], [-a, -b, c]])
    B = np.array([[Rv[0, 0] - p * Rv[2, 0], Rv[0, 1] - p * Rv[2, 1]], [Rv[1, 0] - q * Rv[2, 0], Rv[1, 1] - q * Rv[2, 1]]])
    determinant = B[0, 0] * B[1, 1] - B[0, 1] * B[1, 0]
    if not (np.isfinite(determinant) and abs(determinant) > 1e-12):
        return False
    A = np.array([[B[1, 1], -B[0, 1]], [-B[1, 0], B[0, 0]]]) @ J / determinant
    trace, product = (A * A).sum(), A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
    largest = np.sqrt(0.5 * (trace + np.sqrt(max(trace * trace - 4.0 * product * product, 0.0))))
    if not largest > 0.0:
        return False
    A[:] = A / largest
    b0 = np.sqrt(max(1.0 - A[0, 0] ** 2 - A[1, 0] ** 2, 0.0))
    b1 = np.sqrt(max(1.0 - A[0, 1] ** 2 - A[1, 1] ** 2, 0.0))
    if A[0, 0] * A[0, 1] + A[1, 0] * A[1, 1] > 0.0:
        b1 = -b1
    for branch in range(2):
        sign = 1.0 if branch == 0 else -1.0
        u, v = np.array([A[0, 0], A[1, 0], sign * b0]), np.array([A[0, 1], A[1, 1], sign * b1])
        w = np.array([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])
        for i in range(3):
            R[branch, i, 0] = Rv[i, 0] * u[0] + Rv[i, 1] * u[1] + Rv[i, 2] * u[2]
            R[branch, i, 1] = Rv[i, 0] * v[0] + Rv[i, 1] * v[1] + Rv[i, 2] * v[2]
            R[branch, i, 2] = Rv[i, 0] * w[0] + Rv[i, 1] * w[1] + Rv[i, 2] * w[2]
    return True


@njit
def _place(R: Floats, rays: Floats, half: float, t: Floats) -> None:
    """Write the translation that fits a rotation: linear least squares of z ray - p."""
    sx, sy, sxx, rx, ry, rz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(4):
        X, Y = SIGNS[k, 0] * half, SIGNS[k, 1] * half
        x, y = rays[k, 0], rays[k, 1]
        px, py, pz = R[0, 0] * X + R[0, 1] * Y, R[1, 0] * X + R[1, 1] * Y, R[2, 0] * X + R[2, 1] * Y
        ex, ey = x * pz - px, y * pz - py  # tx - x tz = ex, ty - y tz = ey
        sx, sy, sxx = sx + x, sy + y, sxx + x * x + y * y
        rx, ry, rz = rx + ex, ry + ey, rz - x * ex - y * ey
    t[2] = (rz + (sx * rx + sy * ry) / 4.0) / (sxx - (sx * sx + sy * sy) / 4.0)
    t[0], t[1] = (rx + sx * t[2]) / 4.0, (ry + sy * t[2]) / 4.0


@njit
def _refine(pose: tuple[Floats, Floats], rays: Floats, weights: Floats, half: float, iterations: int) -> float:
    """Improve a pose in place by Gauss-Newton steps of (translation, rotation in the camera); returns its chi-square."""
    R, t = pose
    best = _chi(R, t, rays, weights, half)
    H, g, J, R_new = np.empty((6, 6)), np.empty(6), np.empty((2, 6)), np.empty((3, 3))
    for _ in range(iterations):
        H[:], g[:] = 0.0, 0.0
        for k in range(4):
            X, Y = SIGNS[k, 0] * half, SIGNS[k, 1] * half
            a, b, c = R[0, 0] * X + R[0, 1] * Y, R[1, 0] * X + R[1, 1] * Y, R[2, 0] * X + R[2, 1] * Y
            x, y, z = a + t[0], b + t[1], c + t[2]
            u, v, w = x / z, y / z, 1.0 / z
            r0, r1 = u - rays[k, 0], v - rays[k, 1]
            J[0, 0], J[0, 1], J[0, 2] = w, 0.0, -u * w
            J[1, 0], J[1, 1], J[1, 2] = 0.0, w, -v * w
            for i in range(2):  # d p = theta x (R X)
                J[i, 3] = -J[i, 1] * c + J[i, 2] * b
                J[i, 4] = J[i, 0] * c - J[i, 2] * a
                J[i, 5] = -J[i, 0] * b + J[i, 1] * a
            W = weights[k]
            e0, e1 = W[0, 0] * r0 + W[0, 1] * r1, W[1, 0] * r0 + W[1, 1] * r1
            for i in range(6):
                g[i] -= J[0, i] * e0 + J[1, i] * e1
                m0, m1 = W[0, 0] * J[0, i] + W[0, 1] * J[1, i], W[1, 0] * J[0, i] + W[1, 1] * J[1, i]
                for j in range(i + 1):
                    H[i, j] += m0 * J[0, j] + m1 * J[1, j]
        for i in range(6):
            H[i, i] *= 1.0 + 1e-9
        solve(H, g)
        turn(R, g[3:], R_new)
        t_new = t + g[:3]
        chi = _chi(R_new, t_new, rays, weights, half)
        if not chi < best:
            break
        R[:], t[:] = R_new, t_new
        done = best - chi < SETTLED * best
        best = chi
        if done:
            break
    return best


@njit
def _chi(R: Floats, t: Floats, rays: Floats, weights: Floats, half: float) -> float:
    total = 0.0
    for k in range(4):
        X, Y = SIGNS[k, 0] * half, SIGNS[k, 1] * half
        z = R[2, 0] * X + R[2, 1] * Y + t[2]
        if not z > 0.0:
            return np.inf
        r0 = (R[0, 0] * X + R[0, 1] * Y + t[0]) / z - rays[k, 0]
        r1 = (R[1, 0] * X + R[1, 1] * Y + t[1]) / z - rays[k, 1]
        W = weights[k]
        total += W[0, 0] * r0 * r0 + 2.0 * W[0, 1] * r0 * r1 + W[1, 1] * r1 * r1
    return total


@njit
def turn(R: Floats, theta: Floats, out: Floats) -> None:
    """Write exp(theta) R of a rotation (3, 3) and a rotation vector (3,) [rad]: Rodrigues' formula on each column."""
    x, y, z = theta
    square = x * x + y * y + z * z
    angle = np.sqrt(square)
    if angle < 1e-6:
        a, b = 1.0 - square / 6.0, 0.5 - square / 24.0
    else:
        a, b = np.sin(angle) / angle, (1.0 - np.cos(angle)) / square
    for j in range(3):
        p, q, r = R[0, j], R[1, j], R[2, j]
        along = b * (x * p + y * q + z * r)
        out[0, j] = p + a * (y * r - z * q) + x * along - b * square * p
        out[1, j] = q + a * (z * p - x * r) + y * along - b * square * q
        out[2, j] = r + a * (x * q - y * p) + z * along - b * square * r


@njit
def rotation(theta: Floats) -> Floats:
    """Rotation matrix (3, 3) of a rotation vector (3,) [rad]."""
    R = np.empty((3, 3))
    turn(np.eye(3), theta, R)
    return R
