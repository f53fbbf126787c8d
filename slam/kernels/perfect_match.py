"""Matching optimisation on the error table: Lauer, Lange, Riedmiller, "Calculating the perfect match" (RoboCup 2005).

Poses and points are in the table's own frame: its corner (0, 0) is the origin.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.sandwich import UNBOUNDED, blocks_of, inverse, settle, usable
from slam.kernels.uncertainty import turned

Floats = NDArray[np.float64]
Table = tuple[NDArray[np.float32], float]
"""Interpolants (H, W, 4) of the distance in each cell, cell size [m]."""
Prior = tuple[Floats, Floats]
"""Mean (3,) and information (3, 3) of the pose, in units of the error: what odometry says."""
Schedule = tuple[int, float, float]
"""Most iterations, factors by which steps grow and shrink."""

STEP = 0.02
"""Half the step over which the second derivative is measured: the width of a lidar's noise [m]."""
WEAK = 0.05
"""Standard deviation beyond which a scan's opinion of an axis is left to odometry [m]."""
X, Y, XY = 1, 2, 3
"""Coefficients of an interpolant after its constant."""
SLOPE = 150
"""So many points measure the second derivative."""


@njit
def error(points: Floats, stride: int, pose: Floats, table: Table, c: float, prior: Prior, gradient: Floats) -> float:
    """E(x, y, yaw), the sum of e(d) = 1 - c^2 / (c^2 + d^2) over the observed points, plus what the prior costs; writes its gradient (3,).

    Points (M, 2) [m] are in base, of which every `stride`-th counts. Outside the table the distance is that of its border: no pull.
    """
    patches, cell = table
    height, width = patches.shape[0], patches.shape[1]
    flat, scale, c2 = patches.reshape(-1), 1.0 / cell, c * c
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    total = gx = gy = gt = 0.0
    for i in range(0, len(points), stride):
        rx = cos * points[np.uint32(i), 0] - sin * points[np.uint32(i), 1]
        ry = sin * points[np.uint32(i), 0] + cos * points[np.uint32(i), 1]
        u, v = (rx + pose[0]) * scale, (ry + pose[1]) * scale
        if not (u >= 0.0 and v >= 0.0):
            total += 1.0
            continue
        col, row = np.int32(u), np.int32(v)
        if row >= height or col >= width:
            total += 1.0
            continue
        at = np.uint32(4 * (row * width + col))
        p1, p2, p3 = flat[np.uint32(at + X)], flat[np.uint32(at + Y)], flat[np.uint32(at + XY)]
        a, b = u - col, v - row
        da, db = p1 + p3 * b, p2 + p3 * a
        d = flat[at] + p1 * a + db * b
        share = 1.0 / (c2 + d * d)
        total += d * d * share
        pull = d * share * share  # e'(d) = 2 c^2 d / (c^2 + d^2)^2
        dx, dy = pull * da, pull * db
        gx += dx
        gy += dy
        gt += dy * rx - dx * ry
    gain = 2.0 * c2 * scale * stride
    o0, o1, o2 = pose[0] - prior[0][0], pose[1] - prior[0][1], pose[2] - prior[0][2]
    W = prior[1]
    q0 = W[0, 0] * o0 + W[0, 1] * o1 + W[0, 2] * o2
    q1 = W[1, 0] * o0 + W[1, 1] * o1 + W[1, 2] * o2
    q2 = W[2, 0] * o0 + W[2, 1] * o1 + W[2, 2] * o2
    gradient[0], gradient[1], gradient[2] = gain * gx + q0, gain * gy + q1, gain * gt + q2
    return stride * total + 0.5 * (o0 * q0 + o1 * q1 + o2 * q2)


@njit
def rprop(
    points: Floats,
    stride: int,
    start: Floats,
    table: Table,
    stage: tuple[float, Floats, Floats],
    prior: Prior,
    schedule: Schedule,
) -> tuple[Floats, float, int]:
    """Minimise E by resilient propagation: Riedmiller, Braun, "A direct adaptive method for faster backpropagation learning" (1993).

    Only the sign of each component of the gradient steers, each its own step. The best pose seen is the answer.

    Args:
        points: (M, 2) [m] in base, of which every `stride`-th counts.
        stride: see points.
        start: (3,) pose.
        table: interpolants of the distance.
        stage: c [m], first steps (3,), steps below which it has converged (3,) [m, m, rad].
        prior: what odometry says, in units of E.
        schedule: most iterations, growth and shrinkage of steps.

    Returns:
        pose (3,), E there, iterations.
    """
    c, first, last = stage
    most, grow, shrink = schedule
    pose, step = start.copy(), first.copy()
    gradient, before, best = np.zeros(3), np.zeros(3), start.copy()
    lowest, n = np.inf, 0
    while n < most:
        n += 1
        E = error(points, stride, pose, table, c, prior, gradient)
        if lowest > E:
            lowest = E
            best[:] = pose
        small = True
        for k in range(3):
            product = gradient[k] * before[k]
            if product > 0.0:
                step[k] = min(step[k] * grow, 2.5 * first[k])
            elif product < 0.0:
                step[k] = max(step[k] * shrink, 0.2 * last[k])
            small &= step[k] < last[k]
            pose[k] -= step[k] * np.sign(gradient[k])
            before[k] = gradient[k]
        if small:
            break
    return best, lowest, n


@njit
def match(
    points: Floats,
    starts: Floats,
    table: Table,
    stages: tuple[tuple[float, Floats, Floats], tuple[float, Floats, Floats]],
    prior: tuple[Floats, Floats],
    schedule: Schedule,
    beams: tuple[int, int, float],
) -> tuple[Floats, float, int]:
    """The best pose reached from any start (K, 3): a first stage with few points and a wide c, a second with more and a narrow one.

    Args:
        points: (M, 2) [m] in base.
        starts: (K, 3).
        table: interpolants of the distance.
        stages: c, first and last steps of both.
        prior: mean (3,) and information (3, 3) of the pose [1/m^2], as they are.
        schedule: of RPROP.
        beams: points of the first and of the second stage; variance of a residual, its neighbours that share it counted in [m^2].

    Returns:
        pose (3,), share of the points within the last c of a wall, iterations in all.
    """
    few, more, variance = beams
    first, second = stages
    stride = max(1, len(points) // few)
    wide, narrow_c = (prior[0], prior[1] * (2.0 * variance / first[0] ** 2)), (prior[0], prior[1] * (2.0 * variance / second[0] ** 2))
    chosen, lowest, total = starts[0].copy(), np.inf, 0
    for k in range(len(starts)):
        pose, _, n = rprop(points, stride, starts[k], table, first, wide, schedule)
        total += n
        reached = np.inf
        if len(starts) > 1:
            reached = error(points, stride, pose, table, second[0], narrow_c, np.empty(3))
        if k == 0 or lowest > reached:
            chosen, lowest = pose, reached
    pose, _, n = rprop(points, max(1, len(points) // more), chosen, table, second, narrow_c, schedule)
    return pose, explained(points, pose, table, second[0]), total + n


@njit
def explained(points: Floats, pose: Floats, table: Table, c: float) -> float:
    """Share of points (M, 2) nearer than c to a wall."""
    J, r, places = np.empty((len(points), 3)), np.empty(len(points)), np.empty((len(points), 2))
    n = _residuals(points, 1, pose, table, (J, r, places))
    return np.sum(np.abs(r[:n]) < c) / max(len(points), 1)


@njit
def fuse(points: Floats, pose: Floats, table: Table, c: float, prior: tuple[Floats, Floats], common: float) -> tuple[Floats, Floats]:
    """Kalman's update in its information form: what matching found (its variance from the second derivative of E) and odometry's guess.

    Args:
        points: (M, 2) [m] in base, neighbours beside each other.
        pose: (3,) where E is lowest.
        table: interpolants of the distance.
        c: [m]
        prior: mean (3,) and covariance (3, 3) by odometry.
        common: standard deviation that the residuals of half a metre of wall have in common [m].

    Returns:
        pose (3,) and covariance (3, 3).
    """
    J, r, w, places = np.empty((len(points), 3)), np.empty(len(points)), np.empty(len(points)), np.empty((len(points), 2))
    n = _residuals(points, 1, pose, table, (J, r, places))
    for i in range(n):
        w[i] = (c * c / (c * c + r[i] * r[i])) ** 2
    blocks = blocks_of((J, r, w, places, n))
    stride = max(1, len(points) // SLOPE)
    offset = pose - prior[0]
    step, covariance = settle(blocks, _slope(points, stride, pose, table, c), (offset, prior[1]), UNBOUNDED, common)
    return _without_the_weak(offset + step, covariance, prior, _reach(points))


@njit
def _without_the_weak(correction: Floats, covariance: Floats, prior: tuple[Floats, Floats], reach: float) -> tuple[Floats, Floats]:
    """The fused pose (3,) and covariance (3, 3) without what the scan says along axes of which it knows less than `WEAK`.

    Along a corridor a scan's opinion is faint, but always the same: the map's texture would hold the robot back. Zhang, Kaess, Singh,
    "On degeneracy of optimization-based state estimation problems" (2016), leaves such axes alone, too.
    """
    scale = np.array([1.0, 1.0, 1.0 / reach])
    before, after = inverse(prior[1]), inverse(covariance)
    W, h = np.empty((3, 3)), np.zeros(3)
    for i in range(3):
        for j in range(3):
            W[i, j] = (after[i, j] - before[i, j]) * scale[i] * scale[j]
            h[i] += after[i, j] * correction[j] * scale[i]
    values, vectors = np.linalg.eigh(W)
    if values[0] > 1.0 / WEAK**2:
        return prior[0] + correction, covariance
    after, force = before.copy(), np.zeros(3)
    for k in range(3):
        if values[k] > 1.0 / WEAK**2:
            along = vectors[0, k] * h[0] + vectors[1, k] * h[1] + vectors[2, k] * h[2]
            for i in range(3):
                force[i] += vectors[i, k] * along / scale[i]
                for j in range(3):
                    after[i, j] += values[k] * vectors[i, k] * vectors[j, k] / (scale[i] * scale[j])
    covariance, pose = inverse(after), prior[0].copy()
    for i in range(3):
        for j in range(3):
            pose[i] += covariance[i, j] * force[j]
    return pose, covariance


@njit
def _reach(points: Floats) -> float:
    """How far the points are, root mean square [m]."""
    squares = 0.0
    for i in range(len(points)):
        squares += points[np.uint32(i), 0] * points[np.uint32(i), 0] + points[np.uint32(i), 1] * points[np.uint32(i), 1]
    return max(np.sqrt(squares / max(len(points), 1)), STEP)


@njit
def _slope(points: Floats, stride: int, pose: Floats, table: Table, c: float) -> Floats:
    """Second derivative (3, 3) of E c^2 / 2, by the change of its gradient over `STEP` to both sides."""
    nothing = (np.zeros(3), np.zeros((3, 3)))
    reach = _reach(points)
    slope, ahead, behind = np.empty((3, 3)), np.empty(3), np.empty(3)
    for j in range(3):
        h = STEP if j < 2 else STEP / reach
        moved = pose.copy()
        moved[j] = pose[j] + h
        error(points, stride, moved, table, c, nothing, ahead)
        moved[j] = pose[j] - h
        error(points, stride, moved, table, c, nothing, behind)
        for k in range(3):
            slope[j, k] = 0.25 * c * c * (ahead[k] - behind[k]) / h
    return usable(slope, reach)


@njit
def _residuals(points: Floats, stride: int, pose: Floats, table: Table, found: tuple[Floats, Floats, Floats]) -> int:
    """Write derivative (M, 3), distance (M,) and place (M, 2) of the points that lie in the table; returns how many."""
    patches, cell = table
    J, r, places = found
    height, width = patches.shape[0], patches.shape[1]
    cos, sin, n = np.cos(pose[2]), np.sin(pose[2]), 0
    for i in range(0, len(points), stride):
        rx, ry = cos * points[i, 0] - sin * points[i, 1], sin * points[i, 0] + cos * points[i, 1]
        u, v = (rx + pose[0]) / cell, (ry + pose[1]) / cell
        if not (u >= 0.0 and v >= 0.0 and u < width and v < height):
            continue
        col, row = int(u), int(v)
        p0, p1, p2, p3 = patches[row, col]
        a, b = u - col, v - row
        dx, dy = (p1 + p3 * b) / cell, (p2 + p3 * a) / cell
        J[n, 0], J[n, 1], J[n, 2] = dx, dy, dy * rx - dx * ry
        r[n] = p0 + p1 * a + (p2 + p3 * a) * b
        places[n, 0], places[n, 1] = rx + pose[0], ry + pose[1]
        n += 1
    return n


@njit
def locate(
    points: Floats,
    starts: Floats,
    prior: tuple[Floats, Floats, Floats],
    frame: Floats,
    table: Table,
    stages: tuple[tuple[float, Floats, Floats], tuple[float, Floats, Floats]],
    schedule: Schedule,
    beams: tuple[int, int, float, float, float],
) -> tuple[Floats, Floats, float, int]:
    """`match` and `fuse` with starts (K, 3), prior and answer in the map; `frame` (3,) is T_map_table.

    `prior`: mean (3,) by odometry, covariance (3, 3) of the step since the last scan, covariance (3, 3) of the mean in all. The step's
    weighs odometry against the scan, so that what has moved in the world cannot draw the pose away at once; the answer's covariance is
    what all that is known gives.

    `beams`: points of both stages, standard deviation of a residual [m], residuals that count as one independent, standard deviation
    that the residuals of half a metre of wall have in common [m].

    Returns:
        pose (3,), its covariance (3, 3), share of the points within the last c of a wall, iterations in all.
    """
    few, more, sigma, together, common = beams
    mean = _to_table(prior[0], frame)
    begins = np.empty((len(starts), 3))
    for k in range(len(starts)):
        begins[k] = _to_table(starts[k], frame)
        begins[k, 2] = mean[2] + np.arctan2(np.sin(begins[k, 2] - mean[2]), np.cos(begins[k, 2] - mean[2]))
    covariance = turned(prior[1], -frame[2])
    variance = sigma * sigma * together
    pose, share, n = match(points, begins, table, stages, (mean, inverse(covariance)), schedule, (few, more, variance))
    pose, posterior = fuse(points, pose, table, stages[1][0], (mean, covariance), common)
    known = inverse(posterior) - inverse(covariance) + inverse(turned(prior[2], -frame[2]))
    c, s = np.cos(frame[2]), np.sin(frame[2])
    x, y = pose[0], pose[1]
    pose[0], pose[1], pose[2] = frame[0] + c * x - s * y, frame[1] + s * x + c * y, frame[2] + pose[2]
    return pose, turned(inverse(known), frame[2]), share, n


@njit
def _to_table(pose: Floats, frame: Floats) -> Floats:
    """A pose (3,) of the map in the table's frame."""
    c, s = np.cos(frame[2]), np.sin(frame[2])
    dx, dy = pose[0] - frame[0], pose[1] - frame[1]
    return np.array([c * dx + s * dy, c * dy - s * dx, pose[2] - frame[2]])


@njit
def rank(points: Floats, places: Floats, headings: Floats, table: Table, c: float) -> Floats:
    """E (K, H) of points (M, 2) at places (K, 2) with headings (H,), in the table's frame."""
    patches, cell = table
    height, width = patches.shape[0], patches.shape[1]
    flat, scale, c2 = patches.reshape(-1), 1.0 / cell, c * c
    found, turned_points = np.empty((len(places), len(headings))), np.empty((len(points), 2))
    for h in range(len(headings)):
        cos, sin = np.cos(headings[h]) * scale, np.sin(headings[h]) * scale
        for i in range(len(points)):
            turned_points[i, 0] = cos * points[i, 0] - sin * points[i, 1]
            turned_points[i, 1] = sin * points[i, 0] + cos * points[i, 1]
        for k in range(len(places)):
            x, y, total = places[k, 0] * scale, places[k, 1] * scale, 0.0
            for i in range(len(points)):
                u, v = x + turned_points[np.uint32(i), 0], y + turned_points[np.uint32(i), 1]
                col, row = np.int32(u), np.int32(v)
                if u >= 0.0 and v >= 0.0 and row < height and col < width:
                    d = np.float64(flat[np.uint32(4 * (row * width + col))])
                    total += d * d / (c2 + d * d)
                else:
                    total += 1.0
            found[k, h] = total
    return found


@njit
def refine(
    points: Floats,
    stride: int,
    starts: Floats,
    table: Table,
    stages: tuple[tuple[float, Floats, Floats], tuple[float, Floats, Floats]],
    schedule: Schedule,
) -> tuple[Floats, Floats]:
    """Poses (K, 3) that both stages reach from starts (K, 3) with every `stride`-th point, and E (K,) of all points there."""
    nothing = (np.zeros(3), np.zeros((3, 3)))
    poses, errors, gradient = np.empty_like(starts), np.empty(len(starts)), np.empty(3)
    for k in range(len(starts)):
        pose, _, _ = rprop(points, stride, starts[k], table, stages[0], nothing, schedule)
        pose, _, _ = rprop(points, stride, pose, table, stages[1], nothing, schedule)
        poses[k] = pose
        errors[k] = error(points, 1, pose, table, stages[1][0], nothing, gradient)
    return poses, errors
