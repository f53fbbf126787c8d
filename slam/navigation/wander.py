"""The `wander` policy: on to where there is room, and now and then another way. It needs neither map nor pose."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slam.messages import Estimate, SensorFrame, Twist
from slam.navigation.safe_course import SafeCourse
from slam.se2 import FloatArray
from slam.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class Wander:
    """Drive about at random."""

    course: SafeCourse = field(default_factory=lambda: SafeCourse(speed=0.25, yaw_rate=1.0))
    """How it drives."""
    legs: tuple[float, float] = (4.0, 12.0)
    """Shortest and longest time until it turns to somewhere else [s]."""
    seed: int = 0
    """Of its whims."""

    def build(self, route: FloatArray) -> WanderPolicy:
        """Make the policy; it needs no route."""
        return WanderPolicy(self)


class WanderPolicy:
    """Turns on the spot by a random angle after a leg of random length."""

    def __init__(self, settings: Wander) -> None:
        self._settings = settings
        self._random = np.random.default_rng(settings.seed)
        self._course = settings.course.build()
        self._turn_from = self._turn_until = math.inf
        self._side = 1.0

    def __call__(self, frame: SensorFrame, estimate: Estimate, snapshot: Snapshot) -> Twist:
        """The next command."""
        if frame.stamp >= self._turn_until or math.isinf(self._turn_until):
            self._draw(frame.stamp)
        twist = self._course(frame)
        return Twist(0.0, self._side * self._settings.course.yaw_rate) if frame.stamp >= self._turn_from else twist

    def _draw(self, stamp: float) -> None:
        """The next leg and the turn after it."""
        self._turn_from = stamp + float(self._random.uniform(*self._settings.legs))
        angle = float(self._random.uniform(-math.pi, math.pi))
        self._turn_until = self._turn_from + abs(angle) / self._settings.course.yaw_rate
        self._side = math.copysign(1.0, angle)
