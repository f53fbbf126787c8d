"""How particles move: Thrun, Burgard, Fox, Probabilistic Robotics (2005), chapter 5. `sample(b^2)` has the variance b^2.

The noise of both models is not additive: a way cut into many steps spreads more than in one. Update at one fixed step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from slam.errors import require_not_negative
from slam.kernels import particle_motion as kernels
from slam.kernels.normals import standard_normals
from slam.se2 import SE2, FloatArray, wrap_angle

ON_THE_SPOT = 0.01
"""Below this way [m] its direction says nothing, and all of the turn is the second one: a turn of 0.1 rad on the spot would spread
by 27 deg instead of 1.3."""


class MotionModel(Protocol):
    """Draws poses after a step from poses before it."""

    def sample(self, poses: FloatArray, step: SE2, duration: float, rng: np.random.Generator) -> FloatArray:
        """Poses (N, 3) after a step by odometry, one for each of those before it.

        Args:
            poses: (N, 3) x, y [m], yaw [rad].
            step: T_before_after.
            duration: of the step [s].
            rng: of the noise.
        """
        ...


@dataclass(frozen=True, slots=True)
class OdometryMotion:
    """Turn, way, turn: `sample_motion_model_odometry`, table 5.6."""

    alpha1: float = 0.2
    """Variance of a turn by a turn [rad^2/rad^2]."""
    alpha2: float = 0.2
    """Variance of a turn by a way [rad^2/m^2]."""
    alpha3: float = 0.2
    """Variance of a way by a way [m^2/m^2]."""
    alpha4: float = 0.2
    """Variance of a way by a turn [m^2/rad^2]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "alpha1", "alpha2", "alpha3", "alpha4")

    def sample(self, poses: FloatArray, step: SE2, duration: float, rng: np.random.Generator) -> FloatArray:
        """See `MotionModel`."""
        noise = _normals(len(poses), rng)
        turn, way, last = turn_way_turn(step)
        return kernels.move_by_odometry(poses, (turn, way, last), self.deviations(step), noise)

    def deviations(self, step: SE2) -> tuple[float, float, float]:
        """Standard deviations of the first turn [rad], the way [m] and the second turn [rad]."""
        turn, way, last = turn_way_turn(step)
        squares = way * way, turn * turn, last * last
        return (
            math.sqrt(self.alpha1 * squares[1] + self.alpha2 * squares[0]),
            math.sqrt(self.alpha3 * squares[0] + self.alpha4 * (squares[1] + squares[2])),
            math.sqrt(self.alpha1 * squares[2] + self.alpha2 * squares[0]),
        )

    def covariance(self, step: SE2) -> FloatArray:
        """Covariance (3, 3) of a step (x, y, yaw) in the frame that it starts from, V M V^T with M of these variances [m, rad]."""
        turn, way, _ = turn_way_turn(step)
        c, s = math.cos(turn), math.sin(turn)
        V = np.array([[-way * s, c, 0.0], [way * c, s, 0.0], [1.0, 0.0, 1.0]])
        return V @ np.diag(np.square(self.deviations(step))) @ V.T


@dataclass(frozen=True, slots=True)
class VelocityMotion:
    """An arc at constant speed and yaw rate: `sample_motion_model_velocity`, table 5.3."""

    alpha1: float = 0.1
    """Variance of the speed by the speed [1]."""
    alpha2: float = 0.1
    """Variance of the speed by the yaw rate [m^2/rad^2]."""
    alpha3: float = 0.1
    """Variance of the yaw rate by the speed [rad^2/m^2]."""
    alpha4: float = 0.1
    """Variance of the yaw rate by the yaw rate [1]."""
    alpha5: float = 0.1
    """Variance of the last turn's rate by the speed [rad^2/m^2]."""
    alpha6: float = 0.1
    """Variance of the last turn's rate by the yaw rate [1]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "alpha1", "alpha2", "alpha3", "alpha4", "alpha5", "alpha6")

    def sample(self, poses: FloatArray, step: SE2, duration: float, rng: np.random.Generator) -> FloatArray:
        """See `MotionModel`; without a duration [s] nothing has moved."""
        if duration <= 0.0:
            return poses
        along, _, turn = step.log()
        v, w = float(along) / duration, float(turn) / duration
        noise = _normals(len(poses), rng)
        deviations = (
            math.sqrt(self.alpha1 * v * v + self.alpha2 * w * w),
            math.sqrt(self.alpha3 * v * v + self.alpha4 * w * w),
            math.sqrt(self.alpha5 * v * v + self.alpha6 * w * w),
        )
        return kernels.move_by_velocity(poses, (v, w, duration), deviations, noise)


def _normals(count: int, rng: np.random.Generator) -> NDArray[np.float32]:
    """(3, count) standard normal."""
    bits = rng.bit_generator.random_raw((3 * count + 1) // 2)
    return standard_normals(bits)[: 3 * count].reshape(3, count)


def turn_way_turn(step: SE2) -> tuple[float, float, float]:
    """A step as a turn [rad], a way [m], negative when it leads backwards, and a turn [rad]: table 5.6, lines 2 to 4."""
    way = math.hypot(step.x, step.y)
    turn = math.atan2(step.y, step.x) if way >= ON_THE_SPOT else 0.0
    if abs(turn) > 0.5 * math.pi:
        turn, way = wrap_angle(turn + math.pi), -way
    return turn, way, wrap_angle(step.yaw - turn)


@dataclass(frozen=True, slots=True)
class ConstantVelocity:
    """For a robot without wheel odometry: it goes on as it did, with errors that grow with the time."""

    speed_noise: float = 0.3
    """Standard deviation of the speed, forward and sideways [m/s]."""
    yaw_rate_noise: float = 1.0
    """Standard deviation of the yaw rate [rad/s]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "speed_noise", "yaw_rate_noise")

    def sample(self, poses: FloatArray, step: SE2, duration: float, rng: np.random.Generator) -> FloatArray:
        """See `MotionModel`."""
        noise = rng.standard_normal((len(poses), 3)) * duration
        cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        along, across = step.x + self.speed_noise * noise[:, 0], step.y + self.speed_noise * noise[:, 1]
        yaw = poses[:, 2] + step.yaw + self.yaw_rate_noise * noise[:, 2]
        return np.column_stack([poses[:, 0] + cos * along - sin * across, poses[:, 1] + sin * along + cos * across, yaw])
