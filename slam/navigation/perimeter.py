"""The `perimeter` policy: along the walls at a distance, by the newest scan alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.errors import ParameterError, require_positive
from slam.messages import Estimate, LaserScan, SensorFrame, Trajectory, Twist
from slam.navigation.safe_course import STALE
from slam.scans import deskew
from slam.se2 import FloatArray, wrap_angle
from slam.snapshot import Snapshot

STILL = Trajectory(np.empty(0), np.empty((0, 3)))
HEADINGS = np.radians(np.arange(-100.0, 101.0, 5.0))
"""Ways that are looked at, seen from base, from the wall's side on when it is to the right [rad]."""
FORWARD = math.radians(50.0)
"""A way farther to the side is turned to on the spot [rad]."""

AWAY = math.radians(100.0)
"""How far it turns away from an island, and at most from a wall that it has met."""
NARROW = 0.85
"""In a narrow place, the share of the largest clearance that is kept."""


@dataclass(frozen=True, slots=True)
class Perimeter:
    """Drive to the nearest wall ahead and then keep it at one side, in front of all that stands there.

    Of the ways whose end keeps the distance from everything the one farthest to the wall's side is taken: the border of what a robot as
    wide as the distance could reach is followed.
    """

    distance: float = 0.6
    """From the robot's middle to the wall [m]."""
    side: str = "right"
    """Where the wall is: right or left."""
    speed: float = 0.2
    """[m/s]"""
    yaw_rate: float = 0.8
    """Largest [rad/s]."""
    lookahead: float = 0.35
    """Length of the ways that are looked at [m]."""
    half_width: float = 0.22
    """Half of the way that must be free [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "distance", "speed", "yaw_rate", "lookahead", "half_width")
        if self.side not in ("right", "left"):
            raise ParameterError(self, "side", "right or left")
        if self.distance < self.half_width:
            raise ParameterError(self, "distance", f"at least half_width, {self.half_width:g} m")

    def build(self, route: FloatArray) -> PerimeterPolicy:
        """Make the policy; it needs no route."""
        return PerimeterPolicy(self)


class PerimeterPolicy:
    """Knows whether it has come to a wall, and how far it has turned there: once round towards the wall is an island, which is left."""

    def __init__(self, settings: Perimeter) -> None:
        self._settings = settings
        self._mirror = 1.0 if settings.side == "right" else -1.0
        self._twist, self._stamp = Twist(), -math.inf
        self._at_wall, self._leaving, self._joining = False, False, False
        self._turned, self._heading = 0.0, math.nan  # away from the wall since it was met [rad]

    def __call__(self, frame: SensorFrame, estimate: Estimate, snapshot: Snapshot) -> Twist:
        """The command after the newest scan; a standstill when there has been none for long."""
        heading = estimate.T_map_odom.inverse().yaw + estimate.T_map_base.yaw
        self._turned += 0.0 if math.isnan(self._heading) else self._mirror * wrap_angle(heading - self._heading)
        self._heading = heading
        if frame.scans:
            self._twist, self._stamp = self._answer(frame.scans[-1]), frame.scans[-1].stamp
        return self._twist if frame.stamp - self._stamp <= STALE else Twist()

    def _answer(self, scan: LaserScan) -> Twist:
        """The command, thought with the wall to the right."""
        s = self._settings
        if not bool(np.any(scan.ranges >= scan.range_min)):  # a lidar that sees nothing shows no free way
            return Twist()
        points = deskew(scan, STILL).points * (1.0, self._mirror)
        clear = clearances(points, s.lookahead, HEADINGS)
        thought = self._along(points, clear) if self._met(float(clear[np.abs(HEADINGS) <= FORWARD].min())) else self._towards()
        if float(rooms(points, s.half_width, np.zeros(1))[0]) < s.lookahead:  # whatever was thought, not into what is right ahead
            thought = Twist(0.0, math.copysign(s.yaw_rate, thought.omega))
        return Twist(thought.v, self._mirror * thought.omega)

    def _met(self, ahead: float) -> bool:
        """Whether there is a wall to keep along, after what is ahead [m]."""
        if self._at_wall and self._turned < -math.tau:
            self._at_wall, self._leaving, self._turned = False, True, 0.0
        if not self._at_wall and not self._leaving and ahead <= self._settings.distance:
            self._at_wall, self._joining, self._turned = True, True, 0.0
        return self._at_wall

    def _towards(self) -> Twist:
        """Straight on; away from an island at first."""
        s = self._settings
        self._leaving = self._leaving and self._turned < AWAY
        return Twist(0.0, s.yaw_rate) if self._leaving else Twist(s.speed)

    def _along(self, points: FloatArray, clear: FloatArray) -> Twist:
        """The first way from the wall's side that keeps the distance, or in a narrow place most of what there is.

        A wall that has just been met is turned away from until it is at that side. Where nothing is in the way there the wall has
        ended: round its end.
        """
        s = self._settings
        self._joining = self._joining and float(clear[0]) >= s.distance and self._turned < AWAY
        free = rooms(points, s.half_width, HEADINGS) > s.lookahead
        if self._joining or not free.any():
            return Twist(0.0, s.yaw_rate)
        first = int(np.argmax(free & (clear >= min(s.distance, NARROW * float(clear[free].max())))))
        if first == 0:
            return Twist(s.speed, -s.speed / s.distance)
        heading = float(HEADINGS[first])
        if abs(heading) > FORWARD:
            return Twist(0.0, math.copysign(s.yaw_rate, heading))
        return Twist(s.speed * math.cos(heading) ** 2, max(-s.yaw_rate, min(s.yaw_rate, 2.0 * heading)))


def clearances(points: FloatArray, length: float, headings: FloatArray) -> FloatArray:
    """Distance (K,) [m] of the nearest of points (N, 2) in base from the end of each way of a length [m]."""
    ends = length * np.column_stack([np.cos(headings), np.sin(headings)])
    return np.hypot(*np.moveaxis(points[:, None] - ends, 2, 0)).min(axis=0, initial=np.inf)


def rooms(points: FloatArray, half_width: float, headings: FloatArray) -> FloatArray:
    """Free length (K,) [m] of a strip of twice this half width [m] along each way, among points (N, 2) in base."""
    cos, sin = np.cos(headings)[:, None], np.sin(headings)[:, None]
    along, across = cos * points[:, 0] + sin * points[:, 1], cos * points[:, 1] - sin * points[:, 0]
    return np.where((along > 0.0) & (np.abs(across) < half_width), along, np.inf).min(axis=1, initial=np.inf)
