"""Recordings that are lines of text: read whole and checked before the first reading is delivered."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Self

from hardware.errors import RecordingError
from hardware.logs.held_log import HeldLog
from hardware.logs.log import Event, Reading
from hardware.logs.stamps import StampOrder
from hardware.spec import RobotSpec

_log = logging.getLogger(__name__)


def read_rows(path: Path, take: Callable[[list[bytes]], None]) -> None:
    """Hand the fields of every line that is neither empty nor a comment to `take`, which raises ValueError on a bad one.

    A last line without its line end may be cut; where it cannot be read it is dropped with a warning.

    Raises:
        RecordingError: the file or one of its lines cannot be read.
    """
    try:
        lines = path.read_bytes().split(b"\n")
    except OSError as error:
        raise RecordingError(path, f"cannot be read: {error.strerror}") from error
    for number, line in enumerate(lines, start=1):
        fields = line.split()
        if not fields or fields[0].startswith(b"#"):
            continue
        try:
            take(fields)
        except (ValueError, OverflowError) as error:
            if number < len(lines):
                raise RecordingError(path, f"line {number}: {error}; correct or remove that line") from error
            _log.warning("%s: line %d, the last, is cut and was dropped (%s)", path, number, error)


class TextLog(HeldLog, ABC):
    """A recording of lines; a format says how one line becomes readings. Implements `hardware.logs.log.Log`."""

    def __init__(self, path: Path, spec: RobotSpec | None) -> None:
        super().__init__(path)
        self._given = spec
        self._order = StampOrder()
        read_rows(path, self._take)
        self._order.report(path)
        if not any(event.channel == "scans" for event in self._events):
            raise RecordingError(path, f"{self._seen()}; a recording needs scans")

    @classmethod
    def load(cls, path: Path, spec: RobotSpec | None) -> Self:
        """Read the whole file."""
        return cls(path, spec)

    @property
    @abstractmethod
    def spec(self) -> RobotSpec:
        """The robot that recorded it."""

    @abstractmethod
    def _take(self, fields: list[bytes]) -> None:
        """Turn one line into readings.

        Raises:
            ValueError: the line cannot be used.
        """

    @abstractmethod
    def _seen(self) -> str:
        """What the file holds, for the message that it holds no scans."""

    def _put(self, channel: str, arrival: float, message: Reading) -> None:
        self._events.append(Event(arrival, channel, message))
