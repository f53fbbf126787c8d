"""Whether the pose is supported by what is seen, and when the whole map should be asked for a better one."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slam.errors import ParameterError, require_positive


@dataclass(frozen=True, slots=True)
class HealthRules:
    """When a pose is in doubt, and when it is given up.

    What counts is the share of a scan's beams that the map explains at the pose (`GlobalSearch.judge`): it falls, too, when beams pass
    through walls or meet nothing where there is one. People and moved furniture lower it, for a moment or for good; so a pose is in doubt
    when the share falls well below what it was, and what happens then is for a search of the whole map to decide.
    """

    quick: float = 0.3
    """Time over which the share is averaged that shows a change [s]."""
    slow: float = 20.0
    """Time over which it is averaged to know what is usual in this map [s]."""
    fallen: float = 0.1
    """Fall of the quick average below the slow one that puts the pose in doubt."""
    doubtful: float = 0.6
    """Share below which it is in doubt whatever was usual."""
    lost: float = 0.5
    """Share below which the pose is not supported."""
    patience: float = 1.0
    """Time that it may be so [s]: somebody who passes close by hides nearly everything."""

    def __post_init__(self) -> None:
        require_positive(self, "quick", "slow", "patience")
        for name in ("fallen", "doubtful", "lost"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ParameterError(self, name, "in 0..1")


@dataclass(slots=True)
class HealthWatch:
    """Follows the share over time; the answers are those after the newest scan."""

    rules: HealthRules
    quick: float = math.nan
    """Quick average of the share; nan before the first scan."""
    usual: float = math.nan
    """Slow average of the share while the pose is not in doubt."""
    supported_at: float = math.nan
    """Time of the newest scan that supported the pose [s]."""
    now: float = math.nan

    def add(self, stamp: float, explained: float) -> None:
        """Take in the share of the beams of one scan that the pose explains."""
        if math.isnan(self.quick):
            self.quick = self.usual = explained
            self.now = self.supported_at = stamp
            return
        passed, self.now = max(stamp - self.now, 0.0), stamp
        self.quick += (1.0 - math.exp(-passed / self.rules.quick)) * (explained - self.quick)
        if not self.doubtful:
            self.usual += (1.0 - math.exp(-passed / self.rules.slow)) * (explained - self.usual)
        if self.quick >= self.rules.lost:
            self.supported_at = stamp

    def forget(self) -> None:
        """Begin anew: the robot has been found elsewhere, where other things are usual."""
        self.quick = self.usual = self.supported_at = self.now = math.nan

    @property
    def doubtful(self) -> bool:
        """Whether the whole map should be searched."""
        return not self.usually(self.quick)

    def usually(self, explained: float) -> bool:
        """Whether a share is no worse than what is usual here."""
        return explained >= max(self.rules.doubtful, self.usual - self.rules.fallen)

    @property
    def lost(self) -> bool:
        """Whether nothing has supported the pose for longer than the patience."""
        return self.now - self.supported_at >= self.rules.patience


UNSUPPORTED = HealthRules(patience=2.0)
"""For those that have no recovery, and count beams that end near walls: at a wrong place a third do so by chance."""
NOT_HERE = "the scan does not fit the map here"
