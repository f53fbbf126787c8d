"""Stamps that run back: a little is clamped and counted, much is an error."""

from __future__ import annotations

import logging
import math
from pathlib import Path

_log = logging.getLogger(__name__)

RUN_BACK_LIMIT = 2.0
"""A stamp that runs back by this much or more [s] means that the recording is broken."""


RUN_AHEAD_LIMIT = 86_400.0
"""A recording that is silent for longer than this [s] has a broken clock: every control step of the gap would be run through."""


class StampOrder:
    """Keeps the stamps of each channel, and the arrivals of all, from running back."""

    def __init__(self) -> None:
        self._last: dict[str, float] = {}
        self._arrival = -math.inf
        self._clamped = 0
        self._worst = 0.0

    def last(self, channel: str) -> float:
        """Newest stamp of a channel so far [s]; -inf before the first."""
        return self._last.get(channel, -math.inf)

    def place(self, channel: str, stamp: float, arrival: float) -> tuple[float, float]:
        """Stamp and arrival as they are to be used [s].

        Raises:
            ValueError: a time is not finite, runs back by `RUN_BACK_LIMIT` or more, or ahead by more than `RUN_AHEAD_LIMIT`.
        """
        if not (math.isfinite(stamp) and math.isfinite(arrival)):
            raise ValueError(f"stamp {stamp} of {channel} is not finite")
        if math.isfinite(self._arrival) and max(arrival, stamp) - self._arrival > RUN_AHEAD_LIMIT:
            raise ValueError(f"stamp {stamp} of {channel} is more than {RUN_AHEAD_LIMIT:g} s after the reading before it")
        back = max(self.last(channel) - stamp, self._arrival - arrival)
        if back >= RUN_BACK_LIMIT:
            raise ValueError(f"stamp {stamp} of {channel} runs back by {back:.3f} s; less than {RUN_BACK_LIMIT} s would be clamped")
        if back > 0.0:
            self._clamped += 1
            self._worst = max(self._worst, back)
        self._last[channel] = max(self.last(channel), stamp)
        self._arrival = max(self._arrival, arrival)
        return self._last[channel], self._arrival

    def report(self, path: Path) -> None:
        """Log one warning when anything was clamped."""
        if self._clamped:
            _log.warning("%s: %d stamps ran back, by up to %.3f s; clamped to the ones before", path, self._clamped, self._worst)
