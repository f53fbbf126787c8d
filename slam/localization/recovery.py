"""What to do when the pose is no longer supported by what is seen: a ladder, the cheapest rung first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

from slam.errors import require_not_negative, require_positive
from slam.localization.global_search import GlobalSearch, Hypothesis, same
from slam.localization.health import HealthRules, HealthWatch
from slam.se2 import SE2

AGREE = (0.3, 0.2)
"""Distance [m] and turn [rad] within which two searches have found the same place."""
NEW_VIEW = (0.08, 0.1)
"""Way [m] or turn [rad] after which a second scan is a second opinion."""


class Rung(Enum):
    """How far up."""

    NONE = 0
    EXPAND = 1
    """Spread the particles: the pose is near by (expansion resetting; Ueda, Arai, Sakamoto, Kikuchi, Umeda, IROS 2004)."""
    SEARCH = 2
    """Look for the scan in the whole map and draw particles there (sensor resetting; Lenser, Veloso, ICRA 2000)."""


@dataclass(frozen=True, slots=True)
class Recovery:
    """When which rung is taken. Random particles by w_slow and w_fast come beside it, at every resampling."""

    search: GlobalSearch = field(default_factory=GlobalSearch)
    health: HealthRules = field(default_factory=HealthRules)
    search_every: float = 0.5
    """Time from one search to the next [s]."""
    explained_min: float = 0.6
    """Share of a scan that a place must explain to be taken instead of one that has long been right."""
    spread_position: float = 0.1
    """Standard deviation of one expansion [m]."""
    spread_yaw: float = 0.1
    """Standard deviation of one expansion [rad]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "explained_min", "spread_position", "spread_yaw")
        require_positive(self, "search_every")


class Ladder:
    """Says after every scan what to do."""

    def __init__(self, settings: Recovery) -> None:
        self._settings = settings
        self.watch = HealthWatch(settings.health)
        self._searched = -math.inf  # time of the last search [s]
        self._suspected: list[SE2] = []  # where it found the robot, and the odometry then
        self._suspected_at = SE2()

    def judge(self, stamp: float, explained: float, several: bool) -> Rung:
        """Which rung is due after the scan of a time [s], of which the pose explains a share, while one or several places are possible."""
        self.watch.add(stamp, explained)
        if not (self.watch.doubtful or several):
            self._suspected = []
            return Rung.NONE
        rung = self.search(stamp)
        return rung if rung is Rung.SEARCH or self.watch.lost else Rung.NONE

    def search(self, stamp: float) -> Rung:
        """Search, unless that was done a moment ago."""
        if stamp - self._searched < self._settings.search_every:
            return Rung.EXPAND
        self._searched = stamp
        return Rung.SEARCH

    def confirmed(self, places: Sequence[Hypothesis], T_odom_base: SE2) -> list[Hypothesis]:
        """Those of the places that the search before has found, too, after a way that showed other things; a lost robot may stand still.

        What a scan shows in a doorway may by chance be just what it would show somewhere else, but not twice.
        """
        before, then = self._suspected, self._suspected_at
        step = then.inverse() @ T_odom_base
        if before and not self.lost and math.hypot(step.x, step.y) < NEW_VIEW[0] and abs(step.yaw) < NEW_VIEW[1]:
            return []
        self._suspected, self._suspected_at = [place.T_map_base for place in places], T_odom_base
        return [place for place in places if any(same(one @ step, place.T_map_base, AGREE) for one in before)]

    @property
    def lost(self) -> bool:
        """For so long nothing has supported the pose."""
        return self.watch.lost
