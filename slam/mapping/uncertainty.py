"""Covariances of poses: between the frame that a pose is given in and the body's own, through composition and inversion.

A body covariance of `T_a_b` is that of xi in `T_a_b exp(xi)`: Barfoot, Furgale, "Associating uncertainty with three-dimensional
poses for use in estimation problems" (2014), to first order, in the plane and from the right.
"""

from __future__ import annotations

from slam.kernels import uncertainty as kernels
from slam.se2 import SE2, FloatArray


def to_body(covariance: FloatArray, T_a_b: SE2) -> FloatArray:
    """Body covariance (3, 3) from that of (x, y, yaw) in frame a."""
    return kernels.turned(covariance, -T_a_b.yaw)


def from_body(covariance: FloatArray, T_a_b: SE2) -> FloatArray:
    """Covariance (3, 3) of (x, y, yaw) in frame a from the body's."""
    return kernels.turned(covariance, T_a_b.yaw)


def composed(covariance_ab: FloatArray, T_b_c: SE2, covariance_bc: FloatArray) -> FloatArray:
    """Body covariance (3, 3) of `T_a_b @ T_b_c`, the two being independent."""
    return kernels.carried(covariance_ab, T_b_c.x, T_b_c.y, T_b_c.yaw) + covariance_bc


def inverted(covariance: FloatArray, T_a_b: SE2) -> FloatArray:
    """Body covariance (3, 3) of `T_a_b.inverse()`."""
    return kernels.inverted(covariance, T_a_b.x, T_a_b.y, T_a_b.yaw)
