"""The camera's pose in space from corners in groups: squares of four, or single corners of a board.

Groups may disagree by more than the errors of their corners: a bent print, a lens that K does not describe. How much, one number for all
of them, is estimated together with the pose and added to every corner's variance; without such an excess it is 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.se2 import FloatArray
from slam.se3 import SE3

LOSS, GATE = 5.0, 12.5
"""Chi-square, for each number of a group, at which it counts half, and beyond which it does not fit."""
ITERATIONS, SETTLED = 25, 1e-7
NEAR, BEHIND = 0.01, 1e6
"""Least depth of a corner [m], and the chi-square of a group that has one behind it."""
EXCUSED = 2.0
"""Share of the corners' own variance which the groups' errors may have before there is an excess."""
EXCESS = 0.005
"""Largest excess [rad]: 3 px of a usual camera."""
FEWEST = 2
"""Groups that tell of an excess."""


@dataclass(frozen=True, slots=True, eq=False)
class Corners:
    """What is seen of points that are known: N groups of K."""

    points: FloatArray
    """(N, K, 3) [m]"""
    rays: FloatArray
    """(N, K, 2) x / z, y / z in the camera, without distortion."""
    covariances: FloatArray
    """(N, K, 2, 2) of the rays."""

    @property
    def numbers(self) -> int:
        """Of a group."""
        return 2 * self.rays.shape[1]


@dataclass(frozen=True, slots=True, eq=False)
class CornerPose:
    """A pose that agrees best with corners."""

    T_map_camera: SE3
    covariance: FloatArray
    """(6, 6) of the translation and the rotation vector, in the camera's axes [m, rad]."""
    chi2: FloatArray
    """(N,) of every group, its excess included in the variances."""
    fits: NDArray[np.bool_]
    """(N,) which of the groups agree."""
    excess: float
    """Standard deviation of every ray beyond that of its corner [rad]."""
    cost: float
    """Less twice the logarithm of the likelihood, but for a constant; what does not fit costs as much as at the largest excess."""

    @property
    def believable(self) -> bool:
        """More groups agree than do not."""
        return bool(2 * self.fits.sum() > len(self.fits))


def refined(corners: Corners, start: SE3) -> CornerPose:
    """The pose `T_map_camera` near a start: Gauss-Newton with Cauchy's loss."""
    pose, excess, information = start, _excess(corners, start, np.inf), np.eye(6)
    for _ in range(ITERATIONS):
        weights = _weights(corners, excess)
        residuals, J, chi2 = _linearised(pose, corners, weights)
        shares = np.where(chi2 < BEHIND, 1.0 / (1.0 + chi2 / (LOSS * corners.numbers)), 0.0)
        WJ = shares[:, None, None, None] * (weights @ J)
        information = np.asarray(np.einsum("nkri,nkrj->ij", J, WJ), np.float64) + 1e-9 * np.eye(6)
        gradient = np.asarray(np.einsum("nkri,nkr->i", WJ, residuals), np.float64)
        step = np.asarray(np.linalg.solve(information, -gradient), np.float64)
        pose = pose @ SE3.exp(step * min(1.0, 0.5 / max(float(np.linalg.norm(step)), 1e-12)))
        before, excess = excess, _excess(corners, pose, EXCESS)
        if float(np.abs(step).max()) < SETTLED and abs(excess - before) <= 1e-3 * before:
            break
    weights = _weights(corners, excess)
    chi2 = _linearised(pose, corners, weights)[2]
    fits = chi2 < GATE * corners.numbers
    spread = np.asarray(-np.log(np.linalg.det(weights)).sum(axis=1), np.float64)
    cost = float(np.where(fits, chi2 + spread, GATE * corners.numbers + corners.numbers * np.log(EXCESS**2)).sum())
    return CornerPose(pose, np.asarray(np.linalg.inv(information), np.float64), chi2, fits, excess, cost)


def _excess(corners: Corners, pose: SE3, most: float) -> float:
    """How much farther than their own errors the groups are off, in the median [rad]."""
    if len(corners.points) < FEWEST:
        return 0.0
    off = _linearised(pose, corners, np.broadcast_to(np.eye(2), corners.covariances.shape))[2]
    own = np.trace(corners.covariances, axis1=2, axis2=3).sum(axis=1)
    return float(min(np.sqrt(max(np.median(off - EXCUSED * own) / corners.numbers, 0.0)), most))


def _weights(corners: Corners, excess: float) -> FloatArray:
    return np.asarray(np.linalg.inv(corners.covariances + excess**2 * np.eye(2)), np.float64)


def _linearised(T: SE3, corners: Corners, weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Residuals (N, K, 2), their Jacobian (N, K, 2, 6) by T exp(xi), and chi-squares (N,)."""
    q = (corners.points - T.t) @ T.R
    depth = np.maximum(q[..., 2], NEAR)
    seen = q[..., :2] / depth[..., None]
    P = np.zeros((*depth.shape, 2, 3))
    P[..., 0, 0] = P[..., 1, 1] = 1.0 / depth
    P[..., 2] = -seen / depth[..., None]
    cross = np.zeros((*depth.shape, 3, 3))
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -q[..., 2], q[..., 1], -q[..., 0]
    cross -= np.swapaxes(cross, -1, -2)
    residuals = seen - corners.rays
    chi2 = np.einsum("nki,nkij,nkj->n", residuals, weights, residuals)
    behind = (q[..., 2] <= NEAR).any(axis=1)
    return residuals, np.concatenate([-P, P @ cross], axis=-1), np.where(behind, BEHIND, np.minimum(chi2, BEHIND))
