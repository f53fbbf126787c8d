"""Point-to-line ICP of two scans: Censi, "An ICP variant using a point-to-line metric" (2008)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.counterparts import COARSE, Pairs, find, pair
from slam.kernels.jit import njit
from slam.kernels.line_target import Target
from slam.kernels.localizability import RANGE_NOISE, in_order
from slam.kernels.localizability import information as scan_information
from slam.kernels.normal_equations import descend, write_equations
from slam.kernels.sandwich import NOWHERE, STEP, UNBOUNDED, close_block, narrow, opens_block, settle, usable
from slam.kernels.symmetric import inverse
from slam.kernels.uncertainty import turned

Floats = NDArray[np.float64]
COMMON, LEAST = 0.2, 0.01
"""Share of the residual that half a metre of wall has in common beyond what is seen of it, and the least residual believed [m]."""


@njit
def match(
    source: Floats,
    target: Target,
    start: Floats,
    prior: tuple[Floats, Floats],
    settings: tuple[int, float, float, float, float],
    noise: float,
) -> tuple[Floats, Floats, float, float, bool, int]:
    """Lay `source` (M, 2) [m], in any order, over the target.

    Args:
        source: in its own frame.
        target: as prepared.
        start: (3,) x, y, yaw.
        prior: mean (3,) and covariance (3, 3).
        settings: most iterations, step below which it has converged [m or rad], longest correspondence [m], share of the
            correspondences that is kept, how many times as long as seven in ten of them the longest may be.
        noise: standard deviation of a residual beside the prior [m].

    Returns:
        pose (3,), its covariance (3, 3), RMS residual [m], share of the points with a counterpart, converged, iterations.
    """
    iterations, tolerance, longest, trim, adaptive = settings
    source = in_order(source)
    information = inverse(prior[1]) * (noise * noise)
    mean, pose = prior[0], start.copy()
    pairs = (np.full(len(source), -1), np.empty(len(source)))
    H, g = np.zeros((3, 3)), np.zeros(3)
    few = max(1, len(source) // COARSE)
    limit, converged, n = longest * longest, False, 0
    while n < iterations and not converged:
        n += 1
        limit = pair(source, few, target[0], pose, (longest, trim, adaptive, limit), pairs)
        _normal_equations(source, few, target[1], pose, pairs[0], H, g)
        largest = descend(H, g, pose, (mean, information))
        converged = largest < tolerance
    limit = max(limit, 9.0 * STEP * STEP)  # the same for the answer and for its slope: a tight one hides how noisy the pairs are
    find(source, 1, target[0], pose, limit, pairs)
    blocks, rms, share = _blocks(source, target[1], pose, pairs[0])
    fisher, stride = UNBOUNDED, few
    if narrow(blocks):  # a corridor, of which a few beams may see the end: seldom, and it takes as long again
        fisher, stride = turned(scan_information(source, RANGE_NOISE), pose[2]), 1
    slope = _slope((source, stride), target, pose, limit, pairs)
    step, covariance = settle(blocks, slope, (pose - mean, prior[1]), fisher, COMMON * max(rms, LEAST))
    return pose + step, covariance, rms, share, converged, n + 1


@njit
def _normal_equations(
    source: Floats, stride: int, lines: Floats, pose: Floats, found: NDArray[np.int64], H: Floats, g: Floats
) -> tuple[float, float]:
    """Normal equations of every n-th point: writes H = n sum J^T J, g = n sum J^T d; returns RMS residual, share that has a line."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    h00 = h01 = h02 = h11 = h12 = h22 = g0 = g1 = g2 = squares = 0.0
    n = 0
    for i in range(0, len(source), stride):
        j = found[i]
        if j < 0 or lines[j, 4] == 0.0:
            continue
        rx, ry = c * source[i, 0] - s * source[i, 1], s * source[i, 0] + c * source[i, 1]
        nx, ny = lines[j, 2], lines[j, 3]
        d = nx * (rx + pose[0] - lines[j, 0]) + ny * (ry + pose[1] - lines[j, 1])
        turn = ny * rx - nx * ry
        h00, h01, h02 = h00 + nx * nx, h01 + nx * ny, h02 + nx * turn
        h11, h12, h22 = h11 + ny * ny, h12 + ny * turn, h22 + turn * turn
        g0, g1, g2 = g0 + nx * d, g1 + ny * d, g2 + turn * d
        squares += d * d
        n += 1
    write_equations((h00, h01, h02, h11, h12, h22, g0, g1, g2), stride, H, g)
    return np.sqrt(squares / n) if n > 0 else 0.0, min(stride * n / max(len(source), 1), 1.0)


@njit
def _slope(beams: tuple[Floats, int], target: Target, pose: Floats, limit: float, pairs: Pairs) -> Floats:
    """How the gradient of every n-th point changes over `STEP` to both sides, (3, 3), with the counterparts found anew."""
    source, stride = beams
    reach = max(np.sqrt((source * source).sum() / max(len(source), 1)), STEP)
    steps = (STEP, STEP, STEP / reach)
    slope, H, g, moved = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), pose.copy()
    last, pairs = pairs[0], (pairs[0].copy(), pairs[1].copy())
    for j in range(3):
        for side in (-1.0, 1.0):
            moved[j] = pose[j] + side * steps[j]
            pairs[0][:] = last
            find(source, stride, target[0], moved, limit, pairs, False)
            _normal_equations(source, stride, target[1], moved, pairs[0], H, g)
            slope[:, j] += 0.5 * side / steps[j] * g
        moved[j] = pose[j]
    return usable(slope, reach)


@njit
def _blocks(source: Floats, lines: Floats, pose: Floats, found: NDArray[np.int64]) -> tuple[Floats, float, float]:
    """Blocks (G, 12) of `sandwich`, RMS residual and share of the points that have a line; normals look away from the robot."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    blocks = np.empty((len(source) + 1, 12))
    last, k, n, squares = NOWHERE, 0, 0, 0.0
    h00 = h01 = h02 = h11 = h12 = h22 = g0 = g1 = g2 = a0 = a1 = a2 = 0.0
    for i in range(len(source)):
        j = found[i]
        if j < 0 or lines[j, 4] == 0.0:
            continue
        rx, ry = c * source[i, 0] - s * source[i, 1], s * source[i, 0] + c * source[i, 1]
        nx, ny = lines[j, 2], lines[j, 3]
        if nx * rx + ny * ry < 0.0:
            nx, ny = -nx, -ny
        x, y = rx + pose[0], ry + pose[1]
        new, last = opens_block(last, x, y)
        if new:
            close_block(blocks, k, (h00, h01, h02, h11, h12, h22, g0, g1, g2, a0, a1, a2))
            k += 1
            h00 = h01 = h02 = h11 = h12 = h22 = g0 = g1 = g2 = a0 = a1 = a2 = 0.0
        d, turn = nx * (x - lines[j, 0]) + ny * (y - lines[j, 1]), ny * rx - nx * ry
        h00, h01, h02 = h00 + nx * nx, h01 + nx * ny, h02 + nx * turn
        h11, h12, h22 = h11 + ny * ny, h12 + ny * turn, h22 + turn * turn
        g0, g1, g2 = g0 + nx * d, g1 + ny * d, g2 + turn * d
        a0, a1, a2 = a0 + nx, a1 + ny, a2 + turn
        squares += d * d
        n += 1
    close_block(blocks, k, (h00, h01, h02, h11, h12, h22, g0, g1, g2, a0, a1, a2))
    return blocks[:k], np.sqrt(squares / max(n, 1)), n / max(len(source), 1)
