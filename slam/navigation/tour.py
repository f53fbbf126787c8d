"""The `tour` policy: a plain pursuit follower on the estimate."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.messages import Estimate, SensorFrame, Status, Twist
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class Tour:
    """Follow a closed route of waypoints, round and round.

    Pure pursuit: Coulter, "Implementation of the pure pursuit path tracking algorithm" (1992): the arc through a point
    on the route one look-ahead away has the curvature 2 y / L^2.
    """

    speed: float = 0.25
    """Forward speed on straight legs [m/s]."""
    yaw_rate: float = 1.2
    """Yaw rate when turning on the spot [rad/s]."""
    lookahead: float = 0.30
    """Distance along the route to the point pursued [m]."""
    turn_above: float = 0.9
    """Bearing of the pursued point beyond which the robot turns on the spot [rad]."""
    look_around: float = 0.5
    """Yaw rate at which the robot turns on the spot while it does not know where it is [rad/s]."""

    def build(self, route: FloatArray) -> TourPolicy:
        """Make the policy for waypoints (N, 2) [m] in the map."""
        return TourPolicy(self, route)


class TourPolicy:
    """Pursues a point that moves along the route ahead of the robot."""

    def __init__(self, settings: Tour, route: FloatArray) -> None:
        self._settings = settings
        self._route = route
        self._corners = self._lengths = np.empty(0)  # the way to the first waypoint, then the round
        self._progress = 0.0

    def __call__(self, frame: SensorFrame, estimate: Estimate, snapshot: Snapshot) -> Twist:
        """The next command; looks around while the pose is lost or one of several."""
        if estimate.status in (Status.LOST, Status.AMBIGUOUS):
            return Twist(0.0, self._settings.look_around)
        return self.pursue(estimate.T_map_base)

    def pursue(self, T_map_base: SE2) -> Twist:
        """The command at a pose."""
        ahead = self._target(T_map_base)
        bearing = math.atan2(ahead[1], ahead[0])
        if abs(bearing) > self._settings.turn_above:
            return Twist(0.0, math.copysign(self._settings.yaw_rate, bearing))
        distance = max(math.hypot(*ahead), 1e-6)
        v = self._settings.speed * max(math.cos(bearing), 0.3)
        omega = 2.0 * v * math.sin(bearing) / distance
        return Twist(v, min(max(omega, -self._settings.yaw_rate), self._settings.yaw_rate))

    def _target(self, T_map_base: SE2) -> tuple[float, float]:
        """The pursued point (x, y) in base [m]: advances until it is a look-ahead away."""
        base = np.array([T_map_base.x, T_map_base.y])
        if len(self._corners) == 0:
            self._corners = np.vstack([base, self._route, self._route[:1]])
            self._lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self._corners, axis=0).T))])
        once_round = self._progress + self._lengths[-1]  # a route may lie wholly within the look-ahead
        while self._progress < once_round and float(np.hypot(*(self._point(self._progress) - base))) < self._settings.lookahead:
            self._progress += 0.02
        x, y = self._point(self._progress) - base
        c, s = math.cos(T_map_base.yaw), math.sin(T_map_base.yaw)
        return float(c * x + s * y), float(c * y - s * x)

    def _point(self, progress: float) -> FloatArray:
        """Point (2,) at a distance along the way [m]; past its end the round starts again at the first waypoint."""
        approach, end = self._lengths[1], self._lengths[-1]
        along = float(progress if progress < end else approach + (progress - approach) % max(end - approach, 1e-6))
        return np.array([float(np.interp(along, self._lengths, self._corners[:, axis])) for axis in (0, 1)])
