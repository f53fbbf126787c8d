"""How far a robot has come since anything spoke for its having been carried away."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.errors import require_not_negative
from slam.kernels.succession import agreement
from slam.se2 import SE2, FloatArray

NOTHING = np.empty((0, 2))
FEWEST = 30
"""Points below which two scans cannot be compared."""


@dataclass(frozen=True, slots=True)
class TrustRules:
    """When scans follow one another as they must, whatever the map says: moved furniture breaks no track, to be carried away does."""

    agreement: float = 0.85
    """Share of a scan that must be where the scan before has it; people who walk by take less."""
    tolerance: float = 0.1
    """Difference of near ranges that still is the same place [m]."""
    tolerance_share: float = 0.03
    """The same of far ranges, as a share of the range."""
    memory: float = 1.0
    """Way over which a scan may again agree with the last one before a break [m, or as many radians]."""
    earned: float = 1.0
    """Way with support by the map after which a track is trusted [m, or as many radians]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "agreement", "tolerance", "tolerance_share", "memory", "earned")


class Trust:
    """Follows the scans of a track: trusted once the map has supported it for a way on which no scan contradicts the one before."""

    def __init__(self, rules: TrustRules) -> None:
        self._rules = rules
        self._points, self._at = NOTHING, SE2()  # of the last scan that agreed with the one before it
        self._newest, self._newest_points = SE2(), NOTHING
        self._way = 0.0  # with support, since the last break [m or rad]
        self._broken = False

    @property
    def earned(self) -> bool:
        """Whether the robot is where its track leads to, unless something speaks much for another place."""
        return not self._broken and self._way >= self._rules.earned

    def follow(self, points: FloatArray, T_odom_base: SE2) -> None:
        """Take in a scan, points (N, 2) in base [m], and where wheels lead to."""
        self._newest, self._newest_points = T_odom_base, points
        share, compared = agreement(self._points, points, self._since(), (self._rules.tolerance, self._rules.tolerance_share))
        self._broken = len(self._points) > 0 and (compared < FEWEST or share < self._rules.agreement)
        if self._broken and _length(self._since()) < self._rules.memory:
            return
        if self._broken:
            self._way, self._broken = 0.0, False
        self._points, self._at = points, T_odom_base

    def support(self, step: SE2, supported: bool, fits: bool) -> None:
        """Count a step, if the map supports the pose that it leads to.

        Args:
            step: since the scan before.
            supported: by the scans of late.
            fits: the newest scan as well as is usual. Then nobody has carried the robot, whatever the scans before show: somebody who
                passed by has hidden what is around it, and from here on they follow one another again.
        """
        self._way += _length(step.as_array()) if supported else 0.0
        if self._broken and fits:
            self._points, self._at, self._broken = self._newest_points, self._newest, False

    def forget(self, sure: bool = False) -> None:
        """Begin anew: the robot has been found elsewhere, and whether that is sure."""
        self._way, self._broken = self._rules.earned if sure else 0.0, False
        self._points = NOTHING

    def _since(self) -> FloatArray:
        return (self._at.inverse() @ self._newest).as_array()


def _length(step: FloatArray) -> float:
    return math.hypot(step[0], step[1]) + abs(step[2])
