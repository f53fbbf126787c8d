"""What an episode has come to: the numbers in `info`, and the reward."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from sim.envs.map_kernel import CELL

CELL_AREA = CELL * CELL
PER_STEP = 0.01
"""What a step costs."""
PER_CONTACT = 0.1
"""What a step in contact with something costs."""
AT_THE_GOAL = 10.0
"""What reaching the goal is worth."""
MARKS = (90, 95, 99)
"""Shares of the area whose first reaching is kept [%]."""


@dataclass(slots=True)
class Tally:
    """Counts of one episode."""

    whole: float
    """Area that counts [m^2]; inf where nobody knows it."""
    area: float = 0.0
    """Of it seen so far [m^2]."""
    path: float = 0.0
    """Way driven [m]."""
    steps: int = 0
    collisions: int = 0
    """How often the robot has come into contact with something."""
    marks: dict[int, tuple[float, float]] = field(default_factory=dict[int, tuple[float, float]])
    """Share [%] -> path [m] and time [s] when it was reached."""
    _place: tuple[float, float] = (0.0, 0.0)
    _touching: bool = False

    @property
    def coverage(self) -> float:
        """Share of the area that is seen; 0 where nobody knows the whole."""
        return self.area / self.whole

    def begin(self, gained: int, place: tuple[float, float]) -> None:
        """Take in the first observation."""
        self.area, self._place = gained * CELL_AREA, place

    def add(self, gained: int, place: tuple[float, float], touching: bool, period: float) -> float:
        """Take in a step of a time [s]; returns its reward, but for what the goal is worth."""
        self.steps += 1
        self.area += gained * CELL_AREA
        self.path += math.hypot(place[0] - self._place[0], place[1] - self._place[1])
        self.collisions += touching and not self._touching
        self._place, self._touching = place, touching
        for mark in MARKS:
            if mark not in self.marks and self.coverage >= mark / 100.0:
                self.marks[mark] = self.path, self.steps * period
        return gained * CELL_AREA - PER_STEP - PER_CONTACT * touching

    def info(self, period: float) -> dict[str, Any]:
        """The numbers so far."""
        return {
            "coverage": self.coverage,
            "area": self.area,
            "path_length": self.path,
            "collisions": self.collisions,
            "time": self.steps * period,
        }
