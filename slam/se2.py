"""Rigid motions of the plane, SE(2). Convention: `p_a = T_a_b @ p_b`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
_set = object.__setattr__


def wrap_angle(angle: float) -> float:
    """Wrap an angle to (-pi, pi] [rad]."""
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


@dataclass(frozen=True, slots=True, init=False)
class SE2:
    """A planar pose or transform: translation [m] and heading in (-pi, pi] [rad].

    Exponential coordinates are (v_x, v_y, omega): Sola, Deray, Atchuthan, "A micro Lie theory for state
    estimation in robotics" (2018), appendix B.
    """

    x: float
    y: float
    yaw: float

    def __init__(self, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> None:
        """The heading is wrapped. Written out, for a dataclass takes twice as long, and poses are made thousands of times a second."""
        _set(self, "x", float(x))
        _set(self, "y", float(y))
        _set(self, "yaw", float(yaw) if -math.pi < yaw <= math.pi else wrap_angle(float(yaw)))

    def __matmul__(self, other: SE2) -> SE2:
        """Compose: `T_a_c = T_a_b @ T_b_c`."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return SE2(self.x + c * other.x - s * other.y, self.y + s * other.x + c * other.y, self.yaw + other.yaw)

    def inverse(self) -> SE2:
        """Return `T_b_a` of `T_a_b`."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return SE2(-c * self.x - s * self.y, s * self.x - c * self.y, -self.yaw)

    def transform(self, points: FloatArray) -> FloatArray:
        """Map points (N, 2) [m] of frame b into frame a."""
        return points @ self.rotation().T + np.array([self.x, self.y])

    def rotation(self) -> FloatArray:
        """Rotation matrix (2, 2)."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[c, -s], [s, c]])

    def matrix(self) -> FloatArray:
        """Homogeneous matrix (3, 3)."""
        T = np.eye(3)
        T[:2, :2] = self.rotation()
        T[:2, 2] = self.x, self.y
        return T

    def is_finite(self) -> bool:
        """Whether it is a pose at all: no part is infinite or NaN."""
        return math.isfinite(self.x + self.y + self.yaw)

    def as_array(self) -> FloatArray:
        """(x, y, yaw) as an array (3,)."""
        return np.array([self.x, self.y, self.yaw])

    @classmethod
    def from_array(cls, values: FloatArray) -> SE2:
        """Pose from an array (3,) of x, y [m], yaw [rad]."""
        return cls(float(values[0]), float(values[1]), float(values[2]))

    @classmethod
    def exp(cls, xi: FloatArray) -> SE2:
        """Exponential map of (v_x, v_y, omega): a constant twist for unit time."""
        vx, vy, omega = float(xi[0]), float(xi[1]), float(xi[2])
        a, b = _left_jacobian_terms(omega)
        return cls(a * vx - b * vy, b * vx + a * vy, omega)

    def log(self) -> FloatArray:
        """Logarithm (v_x, v_y, omega), shape (3,): the inverse of `exp` for headings in (-pi, pi]."""
        a, b = _left_jacobian_terms(self.yaw)
        scale = 1.0 / (a * a + b * b)
        return np.array([(a * self.x + b * self.y) * scale, (a * self.y - b * self.x) * scale, self.yaw])

    def adjoint(self) -> FloatArray:
        """Adjoint matrix (3, 3): `T exp(xi) T^-1 = exp(Ad xi)`."""
        Ad = np.eye(3)
        Ad[:2, :2] = self.rotation()
        Ad[:2, 2] = self.y, -self.x
        return Ad


def _left_jacobian_terms(omega: float) -> tuple[float, float]:
    """sin(w)/w and (1 - cos(w))/w, by series near zero."""
    if abs(omega) < 1e-6:
        return 1.0 - omega * omega / 6.0, omega / 2.0 - omega**3 / 24.0
    return math.sin(omega) / omega, 2.0 * math.sin(omega / 2.0) ** 2 / omega


def interpolate(T_a_b: SE2, T_a_c: SE2, fraction: float) -> SE2:
    """Pose a `fraction` (0..1) of the way from the first pose to the second, along a constant twist."""
    return T_a_b @ SE2.exp((T_a_b.inverse() @ T_a_c).log() * fraction)
