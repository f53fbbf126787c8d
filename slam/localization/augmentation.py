"""Augmented MCL: Thrun, Burgard, Fox, Probabilistic Robotics (2005), table 8.3."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slam.errors import ParameterError


@dataclass(frozen=True, slots=True)
class Augmentation:
    """How fast the two averages of the likelihood follow: when the quick one falls below the slow one, the pose is in doubt."""

    alpha_slow: float = 0.001
    """Share of the newest likelihood in the long-term average; 0 never adds particles."""
    alpha_fast: float = 0.1
    """Share of the newest likelihood in the short-term average."""

    def __post_init__(self) -> None:
        for name in ("alpha_slow", "alpha_fast"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ParameterError(self, name, "in 0..1")


@dataclass(slots=True)
class Averages:
    """w_slow and w_fast, both the first w_avg at the start: from 0 the slow one would need a thousand updates."""

    settings: Augmentation
    slow: float = math.nan
    fast: float = math.nan

    def add(self, average: float) -> None:
        """Take in w_avg, the particles' mean of the likelihood of one beam: the geometric mean over the beams, in 0..1.

        The product over 60 beams would add up to three quarters of random poses while all is well.
        """
        if math.isnan(self.slow):
            self.slow = self.fast = average
        self.slow += self.settings.alpha_slow * (average - self.slow)
        self.fast += self.settings.alpha_fast * (average - self.fast)

    @property
    def share(self) -> float:
        """max(0, 1 - w_fast / w_slow): the share of random poses in the next set."""
        if self.settings.alpha_slow == 0.0 or not self.slow > 0.0:
            return 0.0
        return max(0.0, 1.0 - self.fast / self.slow)

    def forget(self) -> None:
        """Begin anew: the robot has been found elsewhere."""
        self.slow = self.fast = math.nan
