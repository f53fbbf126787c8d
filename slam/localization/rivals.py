"""Other places where the robot may be, weighed against the pose over several scans before one is believed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from slam.localization.global_search import Hypothesis, same
from slam.se2 import SE2

AGREE = (0.3, 0.2)
"""Distance [m] and turn [rad] within which two places are one."""
NEW_VIEW = (0.08, 0.1)
"""Way [m] or turn [rad] after which a scan is another opinion."""
STILL = 0.5
"""Time after which it is one for a robot that stands still [s]."""
VIEWS = 2
"""Opinions that are asked for: what a doorway shows may by chance be what is seen somewhere else, but not twice."""
MOST = 8


@dataclass(slots=True)
class Rival:
    """A place and what speaks for it, against the pose."""

    place: Hypothesis
    """By the newest scan."""
    views: int = 0
    explained: float = 0.0
    """Sum of the shares that it explains."""
    gain: float = 0.0
    """Sum of what it explains more than the pose does, as shares."""
    lead: float = 0.0
    """Sum of the differences of scores."""

    def add(self, place: Hypothesis, here: Hypothesis) -> None:
        """Take in one more opinion."""
        self.place = place
        self.views += 1
        self.explained += place.explained
        self.gain += place.explained - here.explained
        self.lead += place.score - here.score


class Rivals:
    """The places that searches have found, carried along by odometry."""

    def __init__(self) -> None:
        self._all: list[Rival] = []
        self._seen_at, self._stamp = SE2(), -math.inf

    def __len__(self) -> int:
        return len(self._all)

    def forget(self) -> None:
        """Begin anew."""
        self._all, self._stamp = [], -math.inf

    def due(self, stamp: float, T_odom_base: SE2) -> bool:
        """Whether a scan of a time [s], taken where wheels say, is another opinion."""
        step = self._seen_at.inverse() @ T_odom_base
        moved = math.hypot(step.x, step.y) >= NEW_VIEW[0] or abs(step.yaw) >= NEW_VIEW[1]
        return bool(self._all) and (moved or stamp - self._stamp >= STILL)

    def places(self, T_odom_base: SE2) -> list[SE2]:
        """Each carried to where wheels say that the robot has come."""
        step = self._seen_at.inverse() @ T_odom_base
        return [rival.place.T_map_base @ step for rival in self._all]

    def weigh(self, places: Sequence[Hypothesis], here: Hypothesis, stamp: float, T_odom_base: SE2) -> None:
        """Take in how well a scan is explained by all, in their order, and by the pose; those that prove worse than it go."""
        for rival, place in zip(self._all, places, strict=True):
            rival.add(place, here)
        self._seen_at, self._stamp = T_odom_base, stamp
        self._all = [rival for rival in self._all if rival.lead > 0.0]

    def meet(self, places: Sequence[Hypothesis], here: Hypothesis, stamp: float, T_odom_base: SE2) -> None:
        """Take up those that are new, at a scan at which the others were weighed, or the first one."""
        self._all = [
            replace(rival, place=replace(rival.place, T_map_base=at)) for rival, at in zip(self._all, self.places(T_odom_base), strict=True)
        ]
        for place in places:
            known = any(same(rival.place.T_map_base, place.T_map_base, AGREE) for rival in self._all)
            if not known and place.score > here.score:
                self._all.append(Rival(place))
                self._all[-1].add(place, here)
        self._all = sorted(self._all, key=lambda rival: -rival.lead / rival.views)[:MOST]
        self._seen_at, self._stamp = T_odom_base, stamp

    def better(self, here: Hypothesis, gain: tuple[float, float], explained: float, odds: float) -> list[Hypothesis]:
        """Places that explain the scans clearly better than the pose, the likeliest first; none where there is none.

        Args:
            here: the pose.
            gain: how much more of the scans a far place must explain, and one near the pose, as shares.
            explained: share that it must explain.
            odds: how many times likelier than the pose it must be by each scan, and than the next place to be the only one.
        """
        least = math.log(odds)
        proven = [
            rival
            for rival in self._all
            if rival.views >= VIEWS
            and rival.place.explained >= explained  # one scan that favours it much does not outweigh the newest, that denies it
            and rival.place.score - here.score >= least
            and rival.explained >= explained * rival.views
            and rival.lead >= least * rival.views
            and rival.gain >= gain[_near(rival.place.T_map_base, here.T_map_base)] * rival.views
        ]
        proven.sort(key=lambda rival: -rival.lead / rival.views)
        return [rival.place for rival in proven if (proven[0].lead / proven[0].views - rival.lead / rival.views) < least]


NEAR = (0.7, 0.5)
"""Distance [m] and turn [rad] within which a track may come to be off by itself."""


def _near(place: SE2, here: SE2) -> bool:
    return same(place, here, NEAR)
