"""How uncertain a step of dead reckoning is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.errors import require_not_negative, require_positive
from slam.kernels.uncertainty import propagated
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True)
class MotionNoise:
    """Variances that grow with the way, so that they do not depend on how it is cut into steps; first-order propagation.

    In the spirit of Thrun, Burgard, Fox, Probabilistic Robotics (2005), section 5.4, with one wheel-slip term each way.
    """

    distance_per_distance: float = 0.01
    """Standard deviation along and across after one metre [m]."""
    yaw_per_distance: float = 0.02
    """Standard deviation of the heading after one metre [rad]."""
    yaw_per_yaw: float = 0.03
    """Standard deviation of the heading after a turn of one radian [rad]."""
    distance_floor: float = 0.002
    """Least position error of a step between scans [m]."""
    yaw_floor: float = 0.002
    """Least heading error of a step between scans [rad]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "distance_per_distance", "yaw_per_distance", "yaw_per_yaw")
        require_positive(self, "distance_floor", "yaw_floor")

    def covariance(self, increment: SE2) -> FloatArray:
        """Covariance (3, 3) of a step (x, y, yaw) [m, rad]: the same in all axes, for it is as uncertain along as across."""
        way, turn = self._variances(increment)
        return np.diag([way, way, turn])

    def with_floor(self, increment: SE2) -> FloatArray:
        """Covariance (3, 3) of a step between two scans, whose matching is never better than the floor."""
        return self.covariance(increment) + np.diag([self.distance_floor**2, self.distance_floor**2, self.yaw_floor**2])

    def propagate(self, covariance: FloatArray, T_map_base: SE2, increment: SE2) -> FloatArray:
        """Covariance (3, 3), in the map frame, of `T_map_base @ increment`."""
        return propagated(covariance, T_map_base.yaw, (increment.x, increment.y), self._variances(increment))

    def _variances(self, increment: SE2) -> tuple[float, float]:
        """Of the way, along it as across [m^2], and of the turn [rad^2]."""
        distance = math.hypot(increment.x, increment.y)
        turn = self.yaw_per_distance**2 * distance + self.yaw_per_yaw**2 * abs(increment.yaw)
        return self.distance_per_distance**2 * distance, turn
