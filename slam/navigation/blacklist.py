"""Places that were tried in vain, for a while."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slam.navigation.navigator import Point


@dataclass(frozen=True, slots=True)
class _Entry:
    place: Point
    until: float
    times: int


class Blacklist:
    """Entries expire; a place that fails again stays for longer."""

    def __init__(self, radius: float, span: float) -> None:
        """`radius` [m] about a place that failed nothing is tried; the first time for `span` [s], then twice as long each time."""
        self._radius, self._span = radius, span
        self._entries: list[_Entry] = []

    def add(self, place: Point, now: float, *, held: bool = True) -> None:
        """A place [m] has failed at a time [s]; where it is not held it may be tried again at once."""
        known = [entry for entry in self._entries if math.dist(entry.place, place) < self._radius]
        times = 1 + max((entry.times for entry in known), default=0)
        self._entries = [entry for entry in self._entries if entry not in known]
        self._entries.append(_Entry(place, now + self._span * 2.0 ** (times - 1) if held else now, times))

    def times(self, place: Point) -> int:
        """How often a place has failed."""
        return max((entry.times for entry in self._entries if math.dist(entry.place, place) < self._radius), default=0)

    def holds(self, place: Point, now: float) -> bool:
        """Whether a place must not be tried at a time [s]."""
        return any(entry.until > now and math.dist(entry.place, place) < self._radius for entry in self._entries)
