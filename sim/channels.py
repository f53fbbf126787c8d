"""The way from a device to its queue: late, unevenly late, and not always successful."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class ChannelErrors:
    """How late events of one channel arrive, and which never do. Their order and their stamps stay; the defaults are none."""

    latency: float = 0.0
    """Mean delay of the ordinary event [s]."""
    jitter: float = 0.0
    """Standard deviation of the delay [s]."""
    tail_share: float = 0.0
    """Share of the events that are held up for longer."""
    tail: float = 0.0
    """Mean of what those take in addition [s]."""
    drop: float = 0.0
    """Share of the events that are lost."""


class Channel(Generic[T]):
    """Events arrive in the order in which they were sent, each after a delay of its own."""

    def __init__(self, errors: ChannelErrors, rng: np.random.Generator) -> None:
        self._errors = errors
        self._perfect = errors == ChannelErrors()
        self._rng = rng
        self._last = 0.0
        self._under_way: deque[tuple[float, T]] = deque()

    @property
    def due(self) -> float:
        """Time of the next arrival [s]; infinite when nothing is under way."""
        return self._under_way[0][0] if self._under_way else np.inf

    def send(self, t: float, event: T) -> None:
        """Put an event on its way at `t` [s]."""
        arrival = t if self._perfect else self._arrival(t)
        if arrival is not None:
            self._last = max(self._last, arrival)
            self._under_way.append((self._last, event))

    def next(self) -> T:
        """Take the event that arrives at `due`."""
        return self._under_way.popleft()[1]

    def arrived(self, now: float) -> list[T]:
        """What has arrived since the last call, oldest first."""
        events: list[T] = []
        while self._under_way and self.due <= now:
            events.append(self.next())
        return events

    def _arrival(self, t: float) -> float | None:
        """Time of arrival; None for an event that is lost. Every event takes the same draws, whatever becomes of it."""
        errors = self._errors
        jitter, tail = self._rng.standard_normal(), self._rng.standard_exponential()
        held_up, lost = self._rng.random(2)
        delay = max(errors.latency + errors.jitter * jitter, 0.0) + (errors.tail * tail if held_up < errors.tail_share else 0.0)
        return None if lost < errors.drop else t + delay
