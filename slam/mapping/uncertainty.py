"""Covariances of poses: between the frame that a pose is given in and the body's own, through composition and inversion.

A body covariance of `T_a_b` is that of xi in `T_a_b exp(xi)`: Barfoot, Furgale, "Associating uncertainty with three-dimensional
poses for use in estimation problems" (2014), to first order, in the plane and from the right.
"""

from __future__ import annotations

import numpy as np

from slam.se2 import SE2, FloatArray


def to_body(covariance: FloatArray, T_a_b: SE2) -> FloatArray:
    """Body covariance (3, 3) from that of (x, y, yaw) in frame a."""
    return _turned(covariance, T_a_b.rotation().T)


def from_body(covariance: FloatArray, T_a_b: SE2) -> FloatArray:
    """Covariance (3, 3) of (x, y, yaw) in frame a from the body's."""
    return _turned(covariance, T_a_b.rotation())


def composed(covariance_ab: FloatArray, T_b_c: SE2, covariance_bc: FloatArray) -> FloatArray:
    """Body covariance (3, 3) of `T_a_b @ T_b_c`, the two being independent."""
    Ad = T_b_c.inverse().adjoint()
    return Ad @ covariance_ab @ Ad.T + covariance_bc


def inverted(covariance: FloatArray, T_a_b: SE2) -> FloatArray:
    """Body covariance (3, 3) of `T_a_b.inverse()`."""
    Ad = T_a_b.adjoint()
    return Ad @ covariance @ Ad.T


def _turned(covariance: FloatArray, R: FloatArray) -> FloatArray:
    turn = np.eye(3)
    turn[:2, :2] = R
    return turn @ covariance @ turn.T
