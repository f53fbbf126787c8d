"""A camera's motion from points in space and where they are seen: the least-squares problem of RGB-D visual odometry.

Points are known from a keyframe's depth image, so that their error lies along the keyframe's rays and grows with the square of the
depth; each row of a rolling shutter sees from where the camera was at that time. Barfoot, State Estimation for Robotics (2017), chapter 8.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.lens import Lens, to_pixel, to_ray
from slam.kernels.planar_pose import rotation

Floats = NDArray[np.float64]
Pose = tuple[Floats, Floats]
"""Rotation (3, 3) and translation (3,) [m]."""
Seen = tuple[Floats, Floats, Floats, Floats]
"""Of N points: place (N, 3) in the keyframe's base [m], error of the place (N, 3) [m], rays (N, 2) in the image, delays (N,) of their
rows after the image's stamp [s]."""
BEHIND = 1e9
"""Chi-square of a point that would be behind the camera."""
NEAR = 0.05
"""Least depth of a point [m]."""
ROUNDS = 6
WINDOW = 2
EDGE = 0.05
"""Largest relative difference of depths about a point: beyond it lies an edge."""
ITERATIONS = 12
SETTLED = 1e-7
WIDEST = 64.0
"""How many times wider the loss is at first."""


@njit
def rays_of(pixels: Floats, lens: Lens) -> Floats:
    """(N, 2) of pixels (N, 2)."""
    out = np.empty(pixels.shape)
    for n in range(len(pixels)):
        out[n] = to_ray(lens, pixels[n, 0], pixels[n, 1])
    return out


@njit
def depths_at(rays: Floats, depth: NDArray[np.float32], lens: Lens, T: Pose) -> Floats:
    """Depth (N,) [m] along the colour camera's axis of its rays (N, 2), nan where it is not known or an edge is near.

    Args:
        rays: of the colour camera.
        depth: (h, w) [m] of a depth camera.
        lens: of the depth camera.
        T: of the depth camera from the colour camera.
    """
    R, t = T
    out = np.full(len(rays), np.nan)
    for n in range(len(rays)):
        ray = np.array([rays[n, 0], rays[n, 1], 1.0])
        turned = R @ ray
        z = 2.0
        for _ in range(ROUNDS):
            p = turned * z + t
            if not p[2] > NEAR:
                z = np.nan
                break
            column, row = to_pixel(lens, p[0] / p[2], p[1] / p[2])
            measured = _smooth_depth(depth, column, row)
            if np.isnan(measured):
                z = np.nan
                break
            z = (measured - t[2]) / turned[2]
        out[n] = z
    return out


@njit
def _smooth_depth(depth: NDArray[np.float32], column: float, row: float) -> float:
    """Mean of the depths about a pixel [m]; nan at an edge, or where most are missing."""
    c, r = int(np.round(column)), int(np.round(row))
    if r < WINDOW or c < WINDOW or r >= depth.shape[0] - WINDOW or c >= depth.shape[1] - WINDOW:
        return np.nan
    total, count, low, high = 0.0, 0, np.inf, 0.0
    for i in range(r - WINDOW, r + WINDOW + 1):
        for j in range(c - WINDOW, c + WINDOW + 1):
            d = depth[i, j]
            if d > 0.0:
                total, count, low, high = total + d, count + 1, min(low, d), max(high, d)
    if 2 * count < (2 * WINDOW + 1) ** 2:
        return np.nan
    mean = total / count
    return mean if high - low < (EDGE + 0.04 * mean) * mean else np.nan


@njit
def placed(rays: Floats, depths: Floats, delays: Floats, mount: Pose, twist: Floats) -> tuple[Floats, Floats]:
    """Points (N, 3) in base at the image's stamp [m], and their directions (N, 3): the change by a metre of depth.

    Args:
        rays: (N, 2).
        depths: (N,) along the camera's axis [m].
        delays: (N,) of the rays' rows after the stamp [s].
        mount: of base from the camera.
        twist: (3,) of base in base: v_x, v_y [m/s], omega [rad/s].
    """
    B, b = mount
    points, directions = np.empty((len(rays), 3)), np.empty((len(rays), 3))
    for n in range(len(rays)):
        direction = B @ np.array([rays[n, 0], rays[n, 1], 1.0])
        p = direction * depths[n] + b
        angle = twist[2] * delays[n]
        c, s = np.cos(angle), np.sin(angle)
        vx, vy = twist[0] * delays[n], twist[1] * delays[n]
        points[n] = c * p[0] - s * p[1] + vx - 0.5 * angle * vy, s * p[0] + c * p[1] + vy + 0.5 * angle * vx, p[2]
        directions[n] = c * direction[0] - s * direction[1], s * direction[0] + c * direction[1], direction[2]
    return points, directions


@njit
def pixels_of(points: Floats, pose: Pose, mount: Pose, lens: Lens) -> Floats:
    """Where points (N, 3) of the keyframe's base are seen from a pose of base in it: (N, 2) [px], nan behind the camera."""
    R, t = pose
    B, b = mount
    out = np.full((len(points), 2), np.nan)
    for n in range(len(points)):
        q = B.T @ (R.T @ (points[n] - t) - b)
        if q[2] > NEAR:
            out[n] = to_pixel(lens, q[0] / q[2], q[1] / q[2])
    return out


@njit
def refine(
    start: Pose, seen: Seen, camera: tuple[Floats, Floats, Floats], prior: tuple[Pose, Floats], noise: tuple[float, float]
) -> tuple[Floats, Floats, Floats, Floats]:
    """Rotation and translation of base in the keyframe's base, what the points tell of it (6, 6), and their chi-squares (N,).

    Levenberg's steps are not needed: the prior holds what the points do not tell. The loss is Cauchy's, wide at first
    (Yang, Antonante, Tzoumas, Carlone, "Graduated non-convexity for robust spatial perception", 2020). Information is of (translation,
    rotation vector) in base, from the right.

    Args:
        start: where the search begins.
        seen: points and rays.
        camera: rotation and translation of base from the camera, and base's twist (3,).
        prior: mean and information (6, 6) of the pose.
        noise: standard deviation of a ray, and the chi-square at which a point counts half.
    """
    turn, t = start[0].copy(), start[1].copy()
    (R0, t0), information = prior
    chi, H, g = np.empty(len(seen[0])), np.empty((6, 6)), np.empty(6)
    wide = WIDEST
    for _ in range(ITERATIONS):
        _sum((turn, t), seen, camera, (noise[0], noise[1] * wide), (H, g, chi))
        off = np.concatenate((turn.T @ (t - t0), _rotation_vector(R0.T @ turn)))
        step = np.linalg.solve(H + information, -(g + information @ off))
        t += turn @ step[:3]
        turn = turn @ rotation(np.asarray(step[3:], np.float64))
        if wide == 1.0 and np.abs(step).max() < SETTLED:
            break
        wide = max(wide / 4.0, 1.0)
    _sum((turn, t), seen, camera, noise, (H, g, chi))
    return turn, t, H, chi


@njit
def _sum(
    pose: Pose, seen: Seen, camera: tuple[Floats, Floats, Floats], noise: tuple[float, float], out: tuple[Floats, Floats, Floats]
) -> None:
    """Write normal equations and chi-squares at a pose."""
    R, t = pose
    points, errors, rays, delays = seen
    B, b, twist = camera
    H, g, chi = out
    H[:], g[:] = 0.0, 0.0
    J, D, C = np.empty((2, 6)), np.empty((2, 3)), np.empty((3, 3))
    p, m, q, e = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    variance = noise[0] * noise[0]
    for n in range(len(points)):
        for k in range(3):  # p: the point in base at the image's stamp
            p[k] = R[0, k] * (points[n, 0] - t[0]) + R[1, k] * (points[n, 1] - t[1]) + R[2, k] * (points[n, 2] - t[2])
            e[k] = R[0, k] * errors[n, 0] + R[1, k] * errors[n, 1] + R[2, k] * errors[n, 2]
        angle = twist[2] * delays[n]
        c, s = np.cos(angle), np.sin(angle)
        m[0], m[1], m[2] = p[0] - twist[0] * delays[n], p[1] - twist[1] * delays[n], p[2]
        for k in range(3):  # C: of the camera at the row's time from base at the stamp
            C[k, 0], C[k, 1], C[k, 2] = B[0, k] * c - B[1, k] * s, B[0, k] * s + B[1, k] * c, B[2, k]
            q[k] = C[k, 0] * m[0] + C[k, 1] * m[1] + C[k, 2] * m[2] - (B[0, k] * b[0] + B[1, k] * b[1] + B[2, k] * b[2])
        if not q[2] > NEAR:
            chi[n] = BEHIND
            continue
        u, v, w = q[0] / q[2], q[1] / q[2], 1.0 / q[2]
        r0, r1 = u - rays[n, 0], v - rays[n, 1]
        for k in range(3):
            D[0, k] = w * (C[0, k] - u * C[2, k])
            D[1, k] = w * (C[1, k] - v * C[2, k])
        e0 = D[0, 0] * e[0] + D[0, 1] * e[1] + D[0, 2] * e[2]
        e1 = D[1, 0] * e[0] + D[1, 1] * e[1] + D[1, 2] * e[2]
        determinant = variance * (variance + e0 * e0 + e1 * e1)
        W00, W11, W01 = (variance + e1 * e1) / determinant, (variance + e0 * e0) / determinant, -e0 * e1 / determinant
        chi[n] = W00 * r0 * r0 + 2.0 * W01 * r0 * r1 + W11 * r1 * r1
        weight = 1.0 / (1.0 + chi[n] / noise[1])
        for i in range(2):
            J[i, 0], J[i, 1], J[i, 2] = -D[i, 0], -D[i, 1], -D[i, 2]
            J[i, 3] = D[i, 1] * p[2] - D[i, 2] * p[1]
            J[i, 4] = D[i, 2] * p[0] - D[i, 0] * p[2]
            J[i, 5] = D[i, 0] * p[1] - D[i, 1] * p[0]
        for k in range(6):
            h0, h1 = weight * (W00 * J[0, k] + W01 * J[1, k]), weight * (W01 * J[0, k] + W11 * J[1, k])
            g[k] += h0 * r0 + h1 * r1
            for i in range(6):
                H[k, i] += h0 * J[0, i] + h1 * J[1, i]


@njit
def _rotation_vector(R: Floats) -> Floats:
    """Rotation vector (3,) of a turn well below half a turn."""
    v = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = np.sqrt(v @ v)
    cosine = 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0)
    return v if sine < 1e-9 else v * (np.arctan2(sine, cosine) / sine)
