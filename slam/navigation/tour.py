"""The `tour` policy: a plain pursuit follower on the estimate."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slam.messages import Estimate, SensorFrame, Status, Twist
from slam.navigation.safe_course import SafeCourse
from slam.se2 import SE2, FloatArray, wrap_angle
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
    """Yaw rate at which the robot turns once on the spot when it does not know where it is [rad/s]."""
    astray: SafeCourse = field(default_factory=SafeCourse)
    """How it drives on if that has not told it: a place that looks like another one must be left."""

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
        self._astray = settings.astray.build()
        self._turned, self._heading = 0.0, 0.0  # while astray [rad], and odometry's heading then

    def __call__(self, frame: SensorFrame, estimate: Estimate, snapshot: Snapshot) -> Twist:
        """The next command; while the pose is lost or one of several, the robot looks around, then looks for other places."""
        heading = estimate.T_map_odom.inverse().yaw + estimate.T_map_base.yaw
        turn, self._heading = abs(wrap_angle(heading - self._heading)), heading
        if estimate.status not in (Status.LOST, Status.AMBIGUOUS):
            self._join(estimate.T_map_base)
            return self.pursue(estimate.T_map_base)
        self._turned += turn if self._turned else 1e-9
        return Twist(0.0, self._settings.look_around) if self._turned < math.tau else self._astray(frame)

    def _join(self, T_map_base: SE2) -> None:
        """After having been astray, go on from the nearest leg of the route."""
        if self._turned >= math.tau:
            ends = np.roll(self._route, -1, axis=0)
            legs = ends - self._route
            base = np.array([T_map_base.x, T_map_base.y])
            shares = np.sum((base - self._route) * legs, axis=1) / np.maximum(np.sum(legs * legs, axis=1), 1e-9)
            nearest = self._route + np.clip(shares, 0.0, 1.0)[:, None] * legs
            leg = int(np.argmin(np.hypot(*(nearest - base).T)))
            self._route, self._corners, self._progress = np.roll(self._route, -(leg + 1), axis=0), np.empty(0), 0.0
        self._turned = 0.0

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
