"""The time of a recording."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from hardware.errors import NotOpenError
from hardware.logs.log import Event, Log
from hardware.queues import EventQueue

RESOLUTION = 1e-9
"""Recordings count whole nanoseconds: a reading is due at `t` when it is as near as that [s]."""
SILENCE = 10.0
"""Nobody waits for the end of a longer silence: the clock jumps to the next reading [s]."""


class ReplayClock:
    """Moves from reading to reading and delivers them. Implements `hardware.hal.Clock`."""

    def __init__(self, log: Log, queues: Mapping[str, EventQueue[Any]]) -> None:
        self._log = log
        self._queues = queues
        self._events: Iterator[Event] | None = None
        self._next: Event | None = None
        self._now = log.span[0]

    @property
    def running(self) -> bool:
        """Between `start` and `stop`."""
        return self._events is not None

    @property
    def ended(self) -> bool:
        """Everything recorded has been delivered."""
        return self._next is None

    def now(self) -> float:
        """Time on the recording's own clock [s]; it starts at the first reading's."""
        return self._now

    def sleep_until(self, t: float) -> bool:
        """Go on to the next reading or to `t` [s], whichever comes first, and over a long silence in one jump. False: there is no more.

        Raises:
            NotOpenError: outside the robot's `open()` .. `close()`.
            RecordingError: the recording cannot be read on.
        """
        if self._events is None:
            raise NotOpenError
        if self._next is None:
            return False
        jump = self._next.arrival - self._now > SILENCE
        self._now = max(self._now, t if t <= self._next.arrival + RESOLUTION and not jump else self._next.arrival)
        while self._next is not None and self._next.arrival <= self._now + RESOLUTION:
            self._queues[self._next.channel].put(self._next.message)
            self._next = next(self._events, None)
        return True

    def start(self) -> None:
        """Back to the first reading."""
        self._events = self._log.events()
        self._next = next(self._events, None)
        self._now = self._log.span[0]

    def stop(self) -> None:
        """Let go of the recording."""
        self._events = self._next = None
