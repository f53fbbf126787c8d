"""The improved proposal of a Rao-Blackwellized particle filter: Grisetti, Stachniss, Burgard (T-RO 2007), algorithm 1, per particle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.patches import MASK, SHIFT, SIDE, Pool, Table

REACH = 2
"""Cells about a beam's end in which its counterpart is looked for."""
MISSING = 3.0
"""A beam without a counterpart counts as one so many standard deviations off."""


@njit
def residuals(
    points: NDArray[np.float64], pose: NDArray[np.float64], table: Table, pool: Pool, look: tuple[float, int], found: NDArray[np.float64]
) -> int:
    """Write for every beam's end how far it is off the map, and in which direction that counts; returns how many have a counterpart.

    The counterpart is the nearest mean hit; where the second nearest is beside it, the distance is that to the line through both.

    Args:
        points: (M, 2) in base [m].
        pose: x, y, yaw in the table's frame.
        table: the particle's map.
        pool: of all maps.
        look: cell size [m], cells about the end in which the counterpart is looked for.
        found: (M, 5) written: residual [m], its direction (2,), the end less the base (2,); nan without a counterpart.
    """
    log_odds, _, offsets = pool
    resolution, reach = look
    height, width = table.shape[0] * SIDE, table.shape[1] * SIDE
    cos, sin, count = np.cos(pose[2]), np.sin(pose[2]), 0
    for i in range(len(points)):
        dx, dy = cos * points[i, 0] - sin * points[i, 1], sin * points[i, 0] + cos * points[i, 1]
        x, y = pose[0] + dx, pose[1] + dy
        col, row = int(np.floor(x / resolution)), int(np.floor(y / resolution))
        first, second = np.inf, np.inf
        ax, ay, bx, by = 0.0, 0.0, 0.0, 0.0
        for r in range(max(row - reach, 0), min(row + reach + 1, height)):
            for c in range(max(col - reach, 0), min(col + reach + 1, width)):
                patch = table[r >> SHIFT, c >> SHIFT]
                if patch < 0 or log_odds[patch, r & MASK, c & MASK] <= 0.0:
                    continue
                px = (c + 0.5) * resolution + offsets[patch, r & MASK, c & MASK, 0]
                py = (r + 0.5) * resolution + offsets[patch, r & MASK, c & MASK, 1]
                square = (px - x) ** 2 + (py - y) ** 2
                if square < first:
                    second, bx, by = first, ax, ay
                    first, ax, ay = square, px, py
                elif square < second:
                    second, bx, by = square, px, py
        if first == np.inf:
            found[i, 0] = np.nan
            continue
        count += 1
        length, away = np.hypot(bx - ax, by - ay), np.sqrt(first)
        nx, ny = ((x - ax) / away, (y - ay) / away) if away > 1e-9 else (1.0, 0.0)
        if second < np.inf and 0.3 * resolution < length < 2.3 * resolution:
            nx, ny = (ay - by) / length, (bx - ax) / length
        found[i, 0], found[i, 1], found[i, 2] = (x - ax) * nx + (y - ay) * ny, nx, ny
        found[i, 3], found[i, 4] = dx, dy
    return count


@njit
def log_likelihood(
    points: NDArray[np.float64],
    pose: NDArray[np.float64],
    table: Table,
    pool: Pool,
    model: tuple[float, float, float],
    found: NDArray[np.float64],
) -> float:
    """Likelihood log p(z | x, m) of points (M, 2) in base at a pose (3,).

    Args:
        points: [m]
        pose: x, y, yaw in the table's frame.
        table: the particle's map.
        pool: of all maps.
        model: cell size [m], standard deviation of a residual [m], beams that count as one.
        found: (M, 5) room for the residuals.
    """
    resolution, sigma, together = model
    residuals(points, pose, table, pool, (resolution, 1), found)
    total, most = 0.0, (MISSING * sigma) ** 2
    for i in range(len(points)):
        square = found[i, 0] ** 2
        total -= square if square < most else most  # nan is not below
    return 0.5 * total / sigma**2 / together


@njit
def register(
    points: NDArray[np.float64],
    guess: NDArray[np.float64],
    information: NDArray[np.float64],
    table: Table,
    pool: Pool,
    model: tuple[float, float, float],
    iterations: int,
    found: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Most likely pose about the guess by Gauss-Newton, its information matrix (3, 3), and the share of points with a counterpart.

    The guess is the mean of the motion model, `information` (3, 3) its inverse covariance; other arguments as in `log_likelihood`.
    """
    resolution, sigma, together = model
    pose, H, J = guess.copy(), information.copy(), np.empty(3)
    share, scale = 0.0, (2.0 * sigma) ** 2
    for _ in range(iterations):
        share = residuals(points, pose, table, pool, (resolution, REACH), found) / max(len(points), 1)
        H[:] = information
        g = information @ (pose - guess)
        for i in range(len(points)):
            residual = found[i, 0]
            if np.isnan(residual):
                continue
            # Geman-McClure: what lies far off counts little
            weight = (scale / (scale + residual**2)) ** 2 / (sigma**2 * together)
            J[0], J[1] = found[i, 1], found[i, 2]
            J[2] = -J[0] * found[i, 4] + J[1] * found[i, 3]
            for a in range(3):
                g[a] += weight * J[a] * residual
                for b in range(3):
                    H[a, b] += weight * J[a] * J[b]
        step = np.linalg.solve(H, g)
        pose -= step
        if np.abs(step).max() < 1e-3:
            break
    return pose, H, share


@njit
def propose(
    points: NDArray[np.float64],
    poses: NDArray[np.float64],
    beliefs: NDArray[np.float64],
    tables: NDArray[np.int32],
    pool: Pool,
    model: tuple[float, float, float],
    limits: tuple[int, float],
    draws: tuple[NDArray[np.float64], NDArray[np.float64]],
    log_weights: NDArray[np.float64],
) -> None:
    """Move particles to poses drawn from the improved proposal, and weigh them.

    Args:
        points: (M, 2) beams' ends in base [m].
        poses: (N, 3) by the motion model, x'_t of the paper; replaced by the drawn x_t.
        beliefs: (N, 3, 3) inverse covariance of the motion model there.
        tables: (N, TH, TW) the particles' maps.
        pool: of all maps.
        model: as in `log_likelihood`.
        limits: most Gauss-Newton steps; least share of points with a counterpart for the scan match to count.
        draws: uniform in -1..1 (N, K, 3) about the mode, normal (N, 3) for the pose drawn.
        log_weights: (N,) written: log of eta of equation 18, or of the likelihood where the scan match failed.
    """
    uniform, normal = draws
    count = uniform.shape[1]
    samples, scores, found = np.empty((count, 3)), np.empty(count), np.empty((len(points), 5))
    for n in range(len(poses)):
        guess = poses[n].copy()
        information: NDArray[np.float64] = beliefs[n]
        mode, H, share = register(points, guess, information, tables[n], pool, model, limits[0], found)
        if share < limits[1] or not np.isfinite(mode).all():
            poses[n] = guess + np.linalg.solve(np.linalg.cholesky(information).T, normal[n])
            log_weights[n] = log_likelihood(points, poses[n], tables[n], pool, model, found)
            continue
        spread = 2.5 * np.sqrt(np.diag(np.linalg.inv(H)))
        for k in range(count):
            samples[k] = mode + spread * uniform[n, k]
            off = samples[k] - guess
            scores[k] = log_likelihood(points, samples[k], tables[n], pool, model, found) - 0.5 * off @ (information @ off)
        best = scores.max()
        tau = np.exp(scores - best)
        eta = tau.sum()
        mean, covariance = np.zeros(3), np.zeros((3, 3))
        for k in range(count):
            mean += tau[k] / eta * samples[k]
        for k in range(count):
            off = samples[k] - mean
            covariance += tau[k] / eta * np.outer(off, off)
        for a in range(3):
            covariance[a, a] += 1e-10
        poses[n] = mean + np.linalg.cholesky(covariance) @ normal[n]
        log_weights[n] = best + np.log(eta / count)
