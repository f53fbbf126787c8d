"""Point-to-line ICP of two scans: Censi, "An ICP variant using a point-to-line metric" (2008). Indices are unsigned where it pays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.localizability import RANGE_NOISE, in_order
from slam.kernels.localizability import information as scan_information
from slam.kernels.sandwich import JUMP, NOWHERE, UNBOUNDED, close_block, inverse, narrow, opens_block, settle, usable
from slam.kernels.uncertainty import turned

Floats = NDArray[np.float64]
Target = tuple[Floats, Floats]
"""Points (N, 2) in the order of their bearings, and the line about each (N, 5): point on it, normal, 1 or 0 where there is none."""
Pairs = tuple[NDArray[np.int64], Floats]
"""Target point (M,) of each source point, -1 for none, and the squared distance between the two (M,) [m^2]."""

STEP = 0.02
"""Half the step over which the gradient's slope is measured: the width of a lidar's noise [m]."""
COARSE = 100
"""So many points show the way; all of them are asked at the end."""
BINS = 128
"""Of the histogram of the correspondences' lengths."""
WINDOW = 4
"""Target points to each side of the last match that are looked at anyway; enough for a step of the width of the noise."""
COMMON, LEAST = 0.2, 0.01
"""Share of the residual that half a metre of wall has in common beyond what is seen of it, and the least residual believed [m]."""


@njit
def prepare(points: Floats, half: float) -> Target:
    """The target of points (N, 2) [m] in any order, with lines through what lies up to `half` [m] beside each point on the same thing.

    The line through the two nearest points alone, as in the paper, turns with their noise: at 1 cm between beams by 45 degrees.
    """
    points = in_order(points)
    n = len(points)
    sums = np.zeros((n + 1, 5))
    lines = np.zeros((n, 5))
    for i in range(n):
        x, y = points[i, 0], points[i, 1]
        sums[i + 1, 0], sums[i + 1, 1] = sums[i, 0] + x, sums[i, 1] + y
        sums[i + 1, 2], sums[i + 1, 3], sums[i + 1, 4] = sums[i, 2] + x * x, sums[i, 3] + x * y, sums[i, 4] + y * y
    breaks = np.zeros(n + 1, np.int64)  # of the thing that each point lies on: how many jumps come before it
    for i in range(1, n):
        jump = (points[i, 0] - points[i - 1, 0]) ** 2 + (points[i, 1] - points[i - 1, 1]) ** 2 > JUMP * JUMP
        breaks[i] = breaks[i - 1] + jump
    first = last = 0
    for i in range(n):
        first, last = max(first, 0), max(last, i)
        while breaks[first] < breaks[i] or (first < i and _apart(points, first, i) > half * half):
            first += 1
        while last + 1 < n and breaks[last + 1] == breaks[i] and _apart(points, last + 1, i) <= half * half:
            last += 1
        if last - first >= 2:
            _fit(sums, first, last + 1, lines[i])
    return points, lines


@njit
def _apart(points: Floats, i: int, j: int) -> float:
    return (points[i, 0] - points[j, 0]) ** 2 + (points[i, 1] - points[j, 1]) ** 2


@njit
def _fit(sums: Floats, first: int, last: int, line: Floats) -> None:
    """Write mean and normal of the points from `first` to before `last`."""
    n = float(last - first)
    mx, my = (sums[last, 0] - sums[first, 0]) / n, (sums[last, 1] - sums[first, 1]) / n
    a = sums[last, 2] - sums[first, 2] - n * mx * mx
    b = sums[last, 3] - sums[first, 3] - n * mx * my
    d = sums[last, 4] - sums[first, 4] - n * my * my
    # the normal is the eigenvector of the smaller eigenvalue
    small = 0.5 * (a + d) - np.sqrt(0.25 * (a - d) ** 2 + b * b)
    nx, ny = (b, small - a) if a > d else (small - d, b)
    length = np.sqrt(nx * nx + ny * ny)
    if length > 0.0:
        line[0], line[1], line[2], line[3], line[4] = mx, my, nx / length, ny / length, 1.0


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
        limit = _pair(source, few, target[0], pose, (longest, trim, adaptive, limit), pairs)
        _normal_equations(source, few, target[1], pose, pairs[0], H, g)
        S = inverse(H + information)
        for i in range(3):
            for j in range(3):
                g[i] += information[i, j] * (pose[j] - mean[j])
        largest = 0.0
        for i in range(3):
            step = S[i, 0] * g[0] + S[i, 1] * g[1] + S[i, 2] * g[2]
            pose[i] -= step
            largest = max(largest, abs(step))
        converged = largest < tolerance
    limit = max(limit, 9.0 * STEP * STEP)  # the same for the answer and for its slope: a tight one hides how noisy the pairs are
    _find(source, 1, target[0], pose, limit, pairs)
    blocks, rms, share = _blocks(source, target[1], pose, pairs[0])
    fisher, stride = UNBOUNDED, few
    if narrow(blocks):  # a corridor, of which a few beams may see the end: seldom, and it takes as long again
        fisher, stride = turned(scan_information(source, RANGE_NOISE), pose[2]), 1
    slope = _slope((source, stride), target, pose, limit, pairs)
    step, covariance = settle(blocks, slope, (pose - mean, prior[1]), fisher, COMMON * max(rms, LEAST))
    return pose + step, covariance, rms, share, converged, n + 1


@njit
def _pair(source: Floats, stride: int, target: Floats, pose: Floats, settings: tuple[float, float, float, float], pairs: Pairs) -> float:
    """Write the correspondences that count of every n-th source point; returns the largest squared distance of one."""
    longest, trim, adaptive, last = settings
    farthest = min(4.0 * last, longest * longest)
    _find(source, stride, target, pose, farthest, pairs)
    limit = _longest(pairs[1], max(stride, len(source) // COARSE), (trim, adaptive), farthest)
    found, squares = pairs
    for i in range(0, len(found), stride):
        if squares[i] > limit:
            found[i] = -1
    return limit


@njit
def _find(source: Floats, stride: int, target: Floats, pose: Floats, farthest: float, pairs: Pairs, thorough: bool = True) -> None:
    """Write the nearest target point of every n-th source point.

    The search starts at the last match, goes by bearing and ends where no ray can come nearer than what it has: 5 to 10 points are
    looked at, as with CSM's jump tables. A `target` point is no nearer than its ray.
    """
    found, squares = pairs
    c, s = np.cos(pose[2]), np.sin(pose[2])
    n, begin = len(target), 0
    zero, one = np.uint32(0), np.uint32(1)
    for i in range(0, len(source), stride):
        x = c * source[i, 0] - s * source[i, 1] + pose[0]
        y = s * source[i, 0] + c * source[i, 1] + pose[1]
        if found[i] >= 0:
            begin = found[i]
        best, nearest = farthest, -1
        low, high = max(begin - WINDOW, 0), min(begin + WINDOW + 1, n)
        for j in range(np.uint32(low), np.uint32(high)):  # without a branch
            dx, dy = x - target[j, zero], y - target[j, one]
            d = dx * dx + dy * dy
            nearest = np.int64(j) if d < best else nearest
            best = min(d, best)
        if not thorough:
            found[i], squares[i] = nearest, best
            continue
        for j in range(np.uint32(max(high - 1, 0)), np.uint32(n)):
            qx, qy = target[j, zero], target[j, one]
            d = (x - qx) * (x - qx) + (y - qy) * (y - qy)
            if d < best:
                best, nearest = d, np.int64(j)
            beyond = qx * y - qy * x
            if beyond < 0.0 and beyond * beyond > best * (qx * qx + qy * qy):
                break
        for back in range(np.uint32(min(low + 1, n))):
            j = np.uint32(min(low, n - 1)) - back
            qx, qy = target[j, zero], target[j, one]
            d = (x - qx) * (x - qx) + (y - qy) * (y - qy)
            if d < best:
                best, nearest = d, np.int64(j)
            beyond = qx * y - qy * x
            if beyond > 0.0 and beyond * beyond > best * (qx * qx + qy * qy):
                break
        found[i], squares[i] = nearest, best
        if nearest >= 0:
            begin = nearest


@njit
def _longest(squares: Floats, stride: int, shares: tuple[float, float], farthest: float) -> float:
    """Largest squared distance of a correspondence that counts: trimmed, and adaptive as in CSM, from a histogram of the lengths."""
    counts = np.zeros(BINS, np.int64)
    n = 0
    for k in range(0, len(squares), stride):
        if squares[k] < farthest:
            counts[int(BINS * np.sqrt(squares[k] / farthest))] += 1
            n += 1
    below, most = 0, 0
    for k in range(BINS):
        below += counts[k]
        if below < 0.7 * n:
            most = k + 1
        if below >= shares[0] * n:
            edge = min(k + 1.0, shares[1] * (most + 1.0)) / BINS
            return min(edge * edge, 1.0) * farthest
    return farthest


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
    H[0, 0], H[0, 1], H[0, 2] = stride * h00, stride * h01, stride * h02
    H[1, 0], H[1, 1], H[1, 2] = stride * h01, stride * h11, stride * h12
    H[2, 0], H[2, 1], H[2, 2] = stride * h02, stride * h12, stride * h22
    g[0], g[1], g[2] = stride * g0, stride * g1, stride * g2
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
            _find(source, stride, target[0], moved, limit, pairs, False)
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
