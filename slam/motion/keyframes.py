"""Which scans enter the map."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slam.errors import require_not_negative
from slam.se2 import SE2


@dataclass(frozen=True, slots=True)
class KeyframeGate:
    """A scan enters the map when the robot has moved since the last one that did."""

    distance: float = 0.05
    """[m]"""
    yaw: float = 0.05
    """[rad]"""

    def __post_init__(self) -> None:
        require_not_negative(self, "distance", "yaw")

    def passes(self, last: SE2 | None, now: SE2) -> bool:
        """True for the first scan and after enough motion."""
        if last is None:
            return True
        step = last.inverse() @ now
        return math.hypot(step.x, step.y) >= self.distance or abs(step.yaw) >= self.yaw
