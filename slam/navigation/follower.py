"""Follows a path with a differential drive: smoothly, slowly where it is tight, and never into what the lidar sees."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.errors import require_positive
from slam.kernels.outlook import nearest
from slam.messages import Twist
from slam.se2 import SE2, FloatArray

SPACING = 0.02
"""Between the points of a path that is followed [m]."""
SHARES = (1.0, 0.6, 0.3)
"""Of the wanted speed that are tried before the robot stops."""
SLACK = 0.003
"""By so much may a hit come nearer that is a little too near already: along a wall its distance is noise [m]."""
NEAR = 1.0
"""Hits farther from the robot do not matter yet [m]."""
HERE = np.zeros((1, 2))
TICK = 0.05
"""Between the poses of a foreseen motion [s]."""


@dataclass(frozen=True, slots=True)
class Follower:
    """Regulated pure pursuit: Macenski, Singh, Martin, Gines, "Regulated pure pursuit for robot path tracking" (2023).

    The arc through a point of the path one look-ahead away has the curvature 2 y / L^2 (Coulter, 1992); the speed falls with the
    curvature, with the room and towards the goal.
    """

    speed: float = 0.30
    """Largest forward speed [m/s]."""
    slowest: float = 0.08
    """Forward speed where it is tight [m/s]."""
    yaw_rate: float = 1.2
    """Largest [rad/s]."""
    acceleration: float = 0.5
    """[m/s^2]"""
    yaw_acceleration: float = 4.0
    """[rad/s^2]"""
    lookahead: tuple[float, float] = (0.15, 0.35)
    """Distance along the path to the point pursued, where it is tight and where there is room [m]."""
    roomy: float = 0.45
    """Room about the robot at which it drives at full speed [m]."""
    turn: tuple[float, float] = (0.9, 0.25)
    """Bearing of the pursued point above which the robot turns on the spot, and below which it then drives on [rad]."""
    arrived: float = 0.08
    """Distance from the end of the path at which it is done [m]."""
    radius: float = 0.15
    """Circle about `base` into which no hit of the lidar may come [m]."""
    latency: float = 0.3
    """Time until a command is obeyed and its effect is seen [s]."""

    def __post_init__(self) -> None:
        names = ("speed", "slowest", "yaw_rate", "acceleration", "yaw_acceleration", "roomy", "arrived", "radius", "latency")
        require_positive(self, *names)

    def build(self) -> PathFollower:
        """Make one; it has no path yet."""
        return PathFollower(self)


class PathFollower:
    """Keeps its place on the path and its last command."""

    def __init__(self, settings: Follower) -> None:
        self._settings = settings
        self._points: FloatArray = np.empty((0, 2))
        self._place = 0
        self._turning = False
        self._stamp = -math.inf
        self._twist = Twist()

    @property
    def left(self) -> float:
        """Length of the path before the robot [m]."""
        return max(len(self._points) - 1 - self._place, 0) * SPACING

    def take(self, corners: FloatArray) -> None:
        """Follow another path (N, 2) [m] in the map."""
        self._points, self._place = resample(corners), 0

    def rest(self, stamp: float) -> Twist:
        """Brake, and stand still."""
        self._turning = False
        return self._eased(Twist(), stamp)

    def face(self, bearing: float, stamp: float) -> Twist:
        """Turn on the spot towards a bearing from base [rad]."""
        rate = min(self._settings.yaw_rate, math.sqrt(self._settings.yaw_acceleration * abs(bearing)) + 0.05)
        return self._eased(Twist(0.0, math.copysign(rate, bearing)), stamp)

    def turn(self, rate: float, stamp: float) -> Twist:
        """Turn on the spot [rad/s]."""
        return self._eased(Twist(0.0, rate), stamp)

    def back(self, speed: float, stamp: float) -> Twist:
        """Drive straight back [m/s]."""
        return self._eased(Twist(-speed, 0.0), stamp)

    def follow(self, T_map_base: SE2, room: float, hits: FloatArray, stamp: float) -> Twist | None:
        """The next command; None: the end is reached.

        Args:
            T_map_base: where the robot is.
            room: about it [m].
            hits: (N, 2) of the lidar in the map [m].
            stamp: [s]
        """
        s = self._settings
        base = np.array([T_map_base.x, T_map_base.y])
        if len(self._points) == 0 or np.hypot(*(self._points[-1] - base)) < s.arrived:
            return None
        x, y = self._target(T_map_base, base, room)
        bearing = math.atan2(y, x)
        self._turning = abs(bearing) > s.turn[1 if self._turning else 0]
        if self._turning:
            return self.face(bearing, stamp)
        wanted = self._pursuit(x, y, room)
        near = T_map_base.inverse().transform(hits[np.hypot(*(hits - base).T) < NEAR])
        safe = next((twist for share in SHARES if self._is_free(twist := Twist(share * wanted.v, share * wanted.omega), near)), None)
        return self._eased(safe or Twist(), stamp)

    def _pursuit(self, x: float, y: float, room: float) -> Twist:
        s = self._settings
        curvature = 2.0 * y / max(x * x + y * y, 1e-6)
        share = min(max((room - s.radius) / max(s.roomy - s.radius, 1e-6), 0.0), 1.0)
        v = s.slowest + (s.speed - s.slowest) * share
        v = min(v, s.yaw_rate / max(abs(curvature), 1e-6), math.sqrt(2.0 * s.acceleration * self.left) + 0.03)
        return Twist(v, min(max(curvature * v, -s.yaw_rate), s.yaw_rate))

    def _target(self, T_map_base: SE2, base: FloatArray, room: float) -> tuple[float, float]:
        """The pursued point in base [m]: one look-ahead beyond the point of the path that is nearest, never back."""
        s = self._settings
        ahead = self._points[self._place : self._place + round(1.0 / SPACING)]
        self._place += int(np.argmin(np.hypot(*(ahead - base).T)))
        tight, roomy = s.lookahead
        lookahead = tight + (roomy - tight) * min(max((room - s.radius) / max(s.roomy - s.radius, 1e-6), 0.0), 1.0)
        point = self._points[min(self._place + round(lookahead / SPACING), len(self._points) - 1)]
        x, y = T_map_base.inverse().transform(point[None])[0].tolist()
        return x, y

    def _is_free(self, twist: Twist, hits: FloatArray) -> bool:
        """Whether the robot can drive so and stop before it comes too near to a hit, or gets farther from those that are too near."""
        s = self._settings
        now = nearest(HERE, hits)
        allowed = now - SLACK if now > s.radius - 0.02 else now + SLACK
        return foreseen_room(twist, s.latency + twist.v / s.acceleration, hits) >= min(s.radius, allowed)

    def _eased(self, twist: Twist, stamp: float) -> Twist:
        """The command within the limits of acceleration; braking for an obstacle has none."""
        s = self._settings
        step = min(max(stamp - self._stamp, 0.0), 0.2)
        v = twist.v if abs(twist.v) < abs(self._twist.v) else _towards(self._twist.v, twist.v, s.acceleration * step)
        self._twist = Twist(v, _towards(self._twist.omega, twist.omega, s.yaw_acceleration * step))
        self._stamp = stamp
        return self._twist


def foreseen_room(twist: Twist, span: float, hits: FloatArray) -> float:
    """Least distance [m] from the middle of the robot to hits (N, 2) in base, while it drives so for a time [s]; inf without hits."""
    times = np.arange(1, math.ceil(span / TICK) + 1) * TICK
    half = 0.5 * twist.omega * times
    chord = twist.v * times * np.sinc(half / math.pi)
    return nearest(np.column_stack([chord * np.cos(half), chord * np.sin(half)]), hits)


def resample(corners: FloatArray) -> FloatArray:
    """Points (M, 2) at equal distances along a path (N, 2) [m], its end included."""
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    along = np.append(np.arange(0.0, lengths[-1], SPACING), lengths[-1])
    return np.column_stack([np.interp(along, lengths, corners[:, axis]) for axis in (0, 1)])


def _towards(value: float, goal: float, step: float) -> float:
    return value + min(max(goal - value, -step), step)
