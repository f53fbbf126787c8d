"""Kalman's fusion of what matching on the error table found with what odometry says."""

from __future__ import annotations

import numpy as np

from slam.kernels.jit import njit
from slam.kernels.sandwich import STEP, UNBOUNDED, blocks_of, reach, settle, usable
from slam.kernels.symmetric import inverse
from slam.kernels.table_error import Floats, Table, error, residuals

WEAK = 0.05
"""Standard deviation beyond which a scan's opinion of an axis is left to odometry [m]."""
SLOPE = 150
"""So many points measure the second derivative."""


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
    n = residuals(points, 1, pose, table, (J, r, places))
    for i in range(n):
        w[i] = (c * c / (c * c + r[i] * r[i])) ** 2
    blocks = blocks_of((J, r, w, places, n))
    stride = max(1, len(points) // SLOPE)
    offset = pose - prior[0]
    step, covariance = settle(blocks, _slope(points, stride, pose, table, c), (offset, prior[1]), UNBOUNDED, common)
    return _without_the_weak(offset + step, covariance, prior, reach(points))


@njit
def _without_the_weak(correction: Floats, covariance: Floats, prior: tuple[Floats, Floats], far: float) -> tuple[Floats, Floats]:
    """The fused pose (3,) and covariance (3, 3) without what the scan says along axes of which it knows less than `WEAK`.

    Along a corridor a scan's opinion is faint, but always the same: the map's texture would hold the robot back. Zhang, Kaess, Singh,
    "On degeneracy of optimization-based state estimation problems" (2016), leaves such axes alone, too.
    """
    scale = np.array([1.0, 1.0, 1.0 / far])
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
def _slope(points: Floats, stride: int, pose: Floats, table: Table, c: float) -> Floats:
    """Second derivative (3, 3) of E c^2 / 2, by the change of its gradient over `STEP` to both sides."""
    nothing = (np.zeros(3), np.zeros((3, 3)))
    far = reach(points)
    slope, ahead, behind = np.empty((3, 3)), np.empty(3), np.empty(3)
    for j in range(3):
        h = STEP if j < 2 else STEP / far
        moved = pose.copy()
        moved[j] = pose[j] + h
        error(points, stride, moved, table, c, nothing, ahead)
        moved[j] = pose[j] - h
        error(points, stride, moved, table, c, nothing, behind)
        for k in range(3):
            slope[j, k] = 0.25 * c * c * (ahead[k] - behind[k]) / h
    return usable(slope, far)
