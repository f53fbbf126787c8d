"""A recording that is kept whole in the memory."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from hardware.logs.log import Event
from slam.messages import Trajectory


class HeldLog:
    """Readings of a format that carries neither a ground truth nor a URDF: most of `hardware.logs.log.Log`."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._events: list[Event] = []

    @property
    def span(self) -> tuple[float, float]:
        """First and last arrival [s], by the clock of the host that recorded."""
        return self._events[0].arrival, self._events[-1].arrival

    def events(self) -> Iterator[Event]:
        """Every reading in file order."""
        return iter(self._events)

    def truth(self) -> Trajectory | None:
        """There is none."""
        return None

    def description(self) -> str:
        """There is none."""
        return ""
