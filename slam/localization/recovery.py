"""What to do when the pose is no longer supported by what is seen: a ladder, the cheapest rung first."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

from slam.errors import require_not_negative, require_positive
from slam.localization.global_search import GlobalSearch, Hypothesis
from slam.localization.health import HealthRules, HealthWatch
from slam.localization.rivals import Rivals
from slam.localization.trust import Trust, TrustRules
from slam.se2 import SE2


class Rung(Enum):
    """How far up."""

    NONE = 0
    SEARCH = 1
    """Look for the scan in the whole map; draw particles at what proves right (sensor resetting; Lenser, Veloso, ICRA 2000), else, when
    lost, spread them: the pose may be near by (expansion resetting; Ueda, Arai, Sakamoto, Kikuchi, Umeda, IROS 2004)."""


@dataclass(frozen=True, slots=True)
class Recovery:
    """When which rung is taken. Random particles by w_slow and w_fast come beside it, at every resampling."""

    search: GlobalSearch = field(default_factory=GlobalSearch)
    health: HealthRules = field(default_factory=HealthRules)
    search_every: float = 0.5
    """Time from one search to the next [s]."""
    trust: TrustRules = field(default_factory=TrustRules)
    explained_min: float = 0.6
    """Share of the scans that a place must explain to be taken instead of the pose."""
    gain: float = 0.15
    """Share of the scans that it must explain more than the pose does."""
    gain_trusted: float = 0.35
    """The same where no scan contradicts the track, or sees through walls: what is new may look like another place."""
    spread_position: float = 0.1
    """Standard deviation of one expansion [m]."""
    spread_yaw: float = 0.1
    """Standard deviation of one expansion [rad]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "explained_min", "gain", "gain_trusted", "spread_position", "spread_yaw")
        require_positive(self, "search_every")


class Ladder:
    """Says after every scan what to do, and keeps what speaks for other places."""

    def __init__(self, settings: Recovery) -> None:
        self._settings = settings
        self.watch = HealthWatch(settings.health)
        self.trust = Trust(settings.trust)
        self.rivals = Rivals()
        self._searched = -math.inf  # time of the last search [s]

    def judge(self, stamp: float, explained: float, step: SE2, several: bool) -> Rung:
        """Which rung is due.

        Args:
            stamp: of the newest scan [s].
            explained: share of it that the pose explains.
            step: way of the robot since the scan before.
            several: whether more than one place is possible.
        """
        self.watch.add(stamp, explained)
        self.trust.support(step, not self.watch.doubtful, self.watch.usually(explained))
        if not (self.watch.doubtful or several):
            self.rivals.forget()
            return Rung.NONE
        return self.search(stamp)

    def search(self, stamp: float) -> Rung:
        """Search, unless that was done a moment ago."""
        if stamp - self._searched < self._settings.search_every:
            return Rung.NONE
        self._searched = stamp
        return Rung.SEARCH

    def proven(self, here: Hypothesis, undenied: bool) -> list[Hypothesis]:
        """Rivals to be believed rather than the pose; `undenied` where the scan does not speak against it, though it may fit badly."""
        s = self._settings
        gain = s.gain_trusted if self.trust.earned or undenied else s.gain
        return self.rivals.better(here, (gain, s.gain), s.explained_min, s.search.odds)

    def begin_anew(self, sure: bool) -> None:
        """The robot has been found elsewhere; what several scans have proven, and nothing else, is trusted at once."""
        self.watch.forget()
        self.trust.forget(sure)
        self.rivals.forget()

    @property
    def lost(self) -> bool:
        """For so long nothing has supported the pose; a track that is trusted leads on through what has been moved."""
        return self.watch.lost and not self.trust.earned
