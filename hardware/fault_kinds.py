"""What can go wrong with a body. Times are since its `open()` [s]."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np

from slam.messages import Imu, LaserScan, RgbdImage, WheelOdometry

Reading = WheelOdometry | Imu | LaserScan | RgbdImage
"""What a channel carries."""


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """In what a reading is spoilt."""

    elapsed: float
    """When it was measured, since `open()` [s]."""
    previous: Reading | None
    """The last one that was delivered; None before the first."""
    rng: np.random.Generator
    """The fault's own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """From when to when something is wrong; always, unless it says otherwise."""

    start: float = 0.0
    end: float = math.inf

    def covers(self, elapsed: float) -> bool:
        """Whether it is wrong at a time since `open()` [s]."""
        return self.start <= elapsed < self.end


class ReadingFault(Protocol):
    """A fault of what a device reports."""

    @property
    def channel(self) -> str:
        """The queue whose readings it spoils."""
        ...

    def covers(self, elapsed: float) -> bool:
        """Whether it is there at a time since `open()` [s]."""
        ...

    def spoil(self, reading: Reading, case: Case) -> Reading | None:
        """The reading as it is delivered; None: it is lost."""
        ...


@dataclass(frozen=True, slots=True)
class Unplugged(Span):
    """A channel is silent."""

    channel: str

    def spoil(self, reading: Reading, case: Case) -> None:
        """See `ReadingFault`."""


@dataclass(frozen=True, slots=True)
class Dropped(Span):
    """Some readings of a channel are lost."""

    channel: str
    share: float

    def spoil(self, reading: Reading, case: Case) -> Reading | None:
        """See `ReadingFault`."""
        return None if case.rng.random() < self.share else reading


@dataclass(frozen=True, slots=True)
class Frozen(Span):
    """A device repeats its last reading under new stamps, as a camera does that hangs."""

    channel: str = "images"

    def spoil(self, reading: Reading, case: Case) -> Reading | None:
        """See `ReadingFault`."""
        return reading if case.previous is None else replace(case.previous, stamp=reading.stamp)


@dataclass(frozen=True, slots=True)
class BeamDropout(Span):
    """Some beams of every scan give an error code."""

    share: float
    channel: str = "scans"

    def spoil(self, reading: Reading, case: Case) -> Reading:
        """See `ReadingFault`."""
        if not isinstance(reading, LaserScan):
            return reading
        lost = case.rng.random(len(reading.ranges)) < self.share
        return replace(reading, ranges=np.where(lost, np.nan, reading.ranges))


@dataclass(frozen=True, slots=True)
class ClockSkew(Span):
    """A device's clock is off: its stamps are late by `offset`, and by `rate` of the time since `open()`."""

    channel: str
    offset: float = 0.0
    """[s]"""
    rate: float = 0.0
    """Share by which the clock runs fast."""

    def spoil(self, reading: Reading, case: Case) -> Reading | None:
        """See `ReadingFault`."""
        return replace(reading, stamp=reading.stamp + self.offset + self.rate * case.elapsed)


@dataclass(frozen=True, slots=True)
class StuckWheel(Span):
    """A wheel does not turn, whatever is commanded; the other one does."""

    wheel: Literal["left", "right"]


@dataclass(frozen=True, slots=True)
class HostStall:
    """The host pauses: from `start` on nobody reads or commands for `duration`."""

    start: float
    duration: float


Fault = Unplugged | Dropped | Frozen | BeamDropout | ClockSkew | StuckWheel | HostStall
