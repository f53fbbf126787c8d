"""A course that needs no map: on to where the newest scan shows room."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.errors import require_positive
from slam.messages import LaserScan, SensorFrame, Trajectory, Twist
from slam.scans import deskew
from slam.se2 import FloatArray

STILL = Trajectory(np.empty(0), np.empty((0, 3)))
HEADINGS = np.radians(np.arange(-80.0, 81.0, 10.0))
"""Ways that are looked at, seen from base [rad]."""
STALE = 0.5
"""Age at which a scan says nothing any more [s]."""


@dataclass(frozen=True, slots=True)
class SafeCourse:
    """Drive slowly where there is room, and turn where there is none; what lies below the lidar's plane it does not see."""

    speed: float = 0.15
    """[m/s]"""
    yaw_rate: float = 0.6
    """Largest [rad/s]."""
    half_width: float = 0.22
    """Half of the way that must be free [m]."""
    stop: float = 0.45
    """Room ahead below which the robot turns on the spot [m]."""
    go: float = 0.8
    """Room ahead at which it then drives on [m]."""
    enough: float = 2.0
    """Room beyond which one way is as good as another [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "speed", "yaw_rate", "half_width", "stop", "go", "enough")

    def build(self) -> SafeCoursePolicy:
        """Make the policy."""
        return SafeCoursePolicy(self)


class SafeCoursePolicy:
    """Keeps to one side while it turns, so that it leaves a corner."""

    def __init__(self, settings: SafeCourse) -> None:
        self._settings = settings
        self._twist, self._stamp = Twist(0.0, 0.0), -math.inf
        self._side = 0.0  # to which it turns on the spot; 0 while it drives

    def __call__(self, frame: SensorFrame) -> Twist:
        """The command after the newest scan; a standstill when there has been none for long."""
        if frame.scans:
            self._twist, self._stamp = self._answer(frame.scans[-1]), frame.scans[-1].stamp
        return self._twist if frame.stamp - self._stamp <= STALE else Twist(0.0, 0.0)

    def _answer(self, scan: LaserScan) -> Twist:
        s = self._settings
        if not bool(np.any(scan.ranges >= scan.range_min)):  # a lidar that sees nothing shows no free way
            return Twist(0.0, 0.0)
        rooms = np.minimum(room(deskew(scan, STILL).points, s.half_width), s.enough)
        ahead = float(rooms[len(rooms) // 2])
        best = float(HEADINGS[int(np.argmax(rooms - 0.1 * np.abs(HEADINGS)))])
        if ahead < (s.go if self._side else s.stop):
            self._side = self._side or math.copysign(1.0, best)
            return Twist(0.0, self._side * s.yaw_rate)
        self._side = 0.0
        return Twist(s.speed * min(1.0, ahead / s.go), max(-s.yaw_rate, min(s.yaw_rate, best)))


def room(points: FloatArray, half_width: float) -> FloatArray:
    """Free length (K,) [m] of a strip of twice this half width [m] along each of `HEADINGS`, among points (N, 2) in base."""
    cos, sin = np.cos(HEADINGS)[:, None], np.sin(HEADINGS)[:, None]
    along, across = cos * points[:, 0] + sin * points[:, 1], cos * points[:, 1] - sin * points[:, 0]
    return np.where((along > 0.0) & (np.abs(across) < half_width), along, np.inf).min(axis=1, initial=np.inf)
