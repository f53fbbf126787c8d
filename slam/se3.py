"""Rigid motions of space, SE(3). Convention: `p_a = T_a_b @ p_b`."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slam.se2 import SE2, FloatArray


def _read_only(values: FloatArray) -> FloatArray:
    frozen = np.array(values, dtype=np.float64)
    frozen.setflags(write=False)
    return frozen


@dataclass(frozen=True, slots=True, eq=False)
class SE3:
    """A transform of space: rotation matrix (3, 3) and translation (3,) [m], both read-only.

    Exponential coordinates are (rho, theta): Sola, Deray, Atchuthan (2018), section IV and appendix D.
    """

    R: FloatArray = field(default_factory=lambda: np.eye(3))
    t: FloatArray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "R", _read_only(self.R).reshape(3, 3))
        object.__setattr__(self, "t", _read_only(self.t).reshape(3))

    def __matmul__(self, other: SE3) -> SE3:
        """Compose: `T_a_c = T_a_b @ T_b_c`."""
        return SE3(self.R @ other.R, self.R @ other.t + self.t)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SE3) and np.array_equal(self.R, other.R) and np.array_equal(self.t, other.t)

    def __hash__(self) -> int:
        return hash((self.R.tobytes(), self.t.tobytes()))

    def inverse(self) -> SE3:
        """Return `T_b_a` of `T_a_b`."""
        return SE3(self.R.T, -self.R.T @ self.t)

    def transform(self, points: FloatArray) -> FloatArray:
        """Map points (N, 3) [m] of frame b into frame a."""
        return points @ self.R.T + self.t

    def matrix(self) -> FloatArray:
        """Homogeneous matrix (4, 4)."""
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.R, self.t
        return T

    @classmethod
    def from_xyz_rpy(cls, xyz: tuple[float, float, float], rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> SE3:
        """Transform from a translation [m] and fixed-axis roll, pitch, yaw [rad], as in URDF: R = Rz(yaw) Ry(pitch) Rx(roll)."""
        (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
        R = np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )
        return cls(R, np.array(xyz))

    def rpy(self) -> tuple[float, float, float]:
        """Fixed-axis roll, pitch, yaw [rad], the inverse of `from_xyz_rpy` away from pitch = +-pi/2."""
        R = self.R
        pitch = float(np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0])))
        return float(np.arctan2(R[2, 1], R[2, 2])), pitch, float(np.arctan2(R[1, 0], R[0, 0]))

    @classmethod
    def from_quaternion(cls, xyzw: FloatArray, t: FloatArray) -> SE3:
        """Transform from a quaternion (x, y, z, w), normalised here, and a translation (3,) [m]."""
        x, y, z, w = np.asarray(xyzw, dtype=np.float64) / np.linalg.norm(xyzw)
        R = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        return cls(R, np.asarray(t, dtype=np.float64))

    def quaternion(self) -> FloatArray:
        """Unit quaternion (x, y, z, w) with w >= 0, shape (4,)."""
        R = self.R
        # Bar-Itzhack (2000): the dominant eigenvector of K is the quaternion, without branches or divisions.
        K = np.array(
            [
                [R[0, 0] - R[1, 1] - R[2, 2], R[1, 0] + R[0, 1], R[2, 0] + R[0, 2], R[2, 1] - R[1, 2]],
                [R[1, 0] + R[0, 1], R[1, 1] - R[0, 0] - R[2, 2], R[2, 1] + R[1, 2], R[0, 2] - R[2, 0]],
                [R[2, 0] + R[0, 2], R[2, 1] + R[1, 2], R[2, 2] - R[0, 0] - R[1, 1], R[1, 0] - R[0, 1]],
                [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], R[0, 0] + R[1, 1] + R[2, 2]],
            ]
        )
        q = np.asarray(np.linalg.eigh(K / 3.0)[1][:, -1], dtype=np.float64)
        return q if q[3] >= 0.0 else -q

    @classmethod
    def exp(cls, xi: FloatArray) -> SE3:
        """Exponential map of (rho, theta), shape (6,): translation part first."""
        rho, theta = np.asarray(xi[:3], dtype=np.float64), np.asarray(xi[3:], dtype=np.float64)
        W, angle = skew(theta), float(np.linalg.norm(theta))
        a, b, c = _rotation_terms(angle)
        return cls(np.eye(3) + a * W + b * W @ W, (np.eye(3) + b * W + c * W @ W) @ rho)

    def log(self) -> FloatArray:
        """Logarithm (rho, theta), shape (6,): the inverse of `exp` for rotations below pi."""
        q = self.quaternion()
        sin_half = float(np.linalg.norm(q[:3]))
        angle = 2.0 * float(np.arctan2(sin_half, q[3]))
        theta = q[:3] * (2.0 if sin_half < 1e-9 else angle / sin_half)
        W = skew(theta)
        _, b, c = _rotation_terms(angle)
        rho = np.asarray(np.linalg.solve(np.eye(3) + b * W + c * W @ W, self.t), dtype=np.float64)
        return np.concatenate([rho, theta])

    def adjoint(self) -> FloatArray:
        """Adjoint matrix (6, 6) for (rho, theta): `T exp(xi) T^-1 = exp(Ad xi)`."""
        Ad = np.zeros((6, 6))
        Ad[:3, :3] = Ad[3:, 3:] = self.R
        Ad[:3, 3:] = skew(self.t) @ self.R
        return Ad

    @classmethod
    def from_se2(cls, T: SE2, z: float = 0.0) -> SE3:
        """Lift a planar transform to space at height `z` [m]."""
        return cls.from_xyz_rpy((T.x, T.y, z), (0.0, 0.0, T.yaw))

    def to_se2(self) -> SE2:
        """Project on the floor: x, y and yaw."""
        return SE2(float(self.t[0]), float(self.t[1]), self.rpy()[2])


def skew(v: FloatArray) -> FloatArray:
    """Cross-product matrix (3, 3) of a vector (3,)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def _rotation_terms(angle: float) -> tuple[float, float, float]:
    """sin(a)/a, (1 - cos(a))/a^2 and (a - sin(a))/a^3, by series near zero."""
    if angle < 1e-4:
        s = angle * angle
        return 1.0 - s / 6.0, 0.5 - s / 24.0, 1.0 / 6.0 - s / 120.0
    return (
        float(np.sin(angle)) / angle,
        2.0 * float(np.sin(angle / 2.0)) ** 2 / angle**2,
        (angle - float(np.sin(angle))) / angle**3,
    )
