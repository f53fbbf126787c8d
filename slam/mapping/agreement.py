"""Whether scans and odometry tell of the same motion: a lidar upside down, or elsewhere than it is said to be, does not."""

from __future__ import annotations

import math

import numpy as np

from slam.se2 import SE2

DISAGREE = "scan and odometry disagree: is the lidar upside down, or elsewhere than its mount says?"
"""Reason of an estimate."""
MEMORY = np.array([1.0, 1.0])
"""Way [m] and turn [rad] after which a step counts e times less."""
ENOUGH = 0.7
"""Share of what the memory can hold at most, from which on it is judged."""
ALIKE = 0.5
"""Least share of odometry's motion that the scans must tell of too."""
ASIDE = 0.2
"""Largest share of odometry's way that the scans may see across it: a mount turned by more than 12 degrees."""

STRAIGHT = 0.3
"""Way with little turning, from which on the course is judged [m]."""


class MotionAgreement:
    """Compares steps between scans, way and turn each on its own, over the last metre and radian."""

    def __init__(self) -> None:
        self._told, self._shared, self._covered = np.zeros(2), np.zeros(2), False
        self._course = np.zeros(2)  # way and what of it the scans see across it: turns about a centre elsewhere fade as they go on
        self.broken = False
        """Over enough of a way or of a turn the scans tell of another motion."""

    def add(self, by_scans: SE2, by_odometry: SE2, covered: bool) -> None:
        """A step from scan to scan, as matching has it and as odometry has it, if it goes on to the newer scan: a gap is no step."""
        known, self._covered = covered and self._covered, covered
        if not known:
            self._told, self._shared, self._course, self.broken = np.zeros(2), np.zeros(2), np.zeros(2), False
            return
        size = np.array([math.hypot(by_odometry.x, by_odometry.y), abs(by_odometry.yaw)])
        c, s = (by_odometry.x / size[0], by_odometry.y / size[0]) if size[0] > 0.0 else (0.0, 0.0)
        way, aside = c * by_scans.x + s * by_scans.y, c * by_scans.y - s * by_scans.x
        turn = math.copysign(1.0, by_odometry.yaw) * by_scans.yaw
        kept = np.exp(-size / MEMORY)
        self._told = kept * self._told + size
        self._shared = kept * self._shared + np.array([way, turn])
        self._course = float(kept.prod()) * self._course + np.array([size[0], aside])
        judged = self._told > ENOUGH * MEMORY
        askew = self._course[0] > STRAIGHT and abs(self._course[1]) > ASIDE * self._course[0]
        self.broken = bool(askew or np.any(judged & (self._shared < ALIKE * self._told)))
