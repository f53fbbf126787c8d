"""The document's own fusion of what odometry predicts with what the particle filter observes: document C, equation 14."""

from __future__ import annotations

import numpy as np

from slam.se2 import SE2, FloatArray, wrap_angle


def gain(D: FloatArray, C: FloatArray, k1: float) -> FloatArray:
    """K (3, 3) = (D + k1 C^-1)^-1 D, as L (k1 I + L^T D L)^-1 L^T D with C = L L^T, which inverts neither.

    Along an axis of which the scan tells nothing its row is 0; without a doubt about the odometry all of it is.

    Args:
        D: dynamic localizability matrix (3, 3) [1/m^2, 1/rad^2].
        C: covariance of the prediction (3, 3) [m, rad].
        k1: weight of the odometry.
    """
    values, vectors = np.linalg.eigh(C)
    L = vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(L @ np.linalg.solve(k1 * np.eye(3) + L.T @ D @ L, L.T @ D), np.float64)


def fused(P_odo: SE2, P_PF: SE2, K: FloatArray) -> SE2:
    """P = P_odo + K (P_PF - P_odo), the heading's difference wrapped."""
    delta = P_PF.as_array() - P_odo.as_array()
    delta[2] = wrap_angle(float(delta[2]))
    return SE2.from_array(P_odo.as_array() + K @ delta)


def moved_along(poses: FloatArray, P: SE2, P_PF: SE2) -> FloatArray:
    """Particles (N, 3) shifted to agree with the fused pose: P (P_PF)^-1 p_i."""
    T = P @ P_PF.inverse()
    return np.column_stack([T.transform(poses[:, :2]), poses[:, 2] + T.yaw])
