"""A driver on a wire whose far end knows the truth."""

from __future__ import annotations

import time
from abc import abstractmethod
from contextlib import ExitStack

from hardware.emulators.port import Port
from hardware.openable import Openable
from scripts.bench.wire.stage import WORLD
from sim.kinematic import Kinematic
from sim.wire import WiredTwin, on_the_wire


class Trial(Openable):
    """The twin in wall-clock time, a port of its, and a driver on it."""

    port: Port

    def __init__(self, name: str, twin: Kinematic | None = None) -> None:
        """What it is called, and its twin."""
        self.name = name
        self._body = twin or Kinematic(world=WORLD, realism=on_the_wire("datasheet"))
        self.wrong = 0
        """Readings that are not true."""
        self.newest = float("-inf")
        """When the device sent the newest true reading, on the host's clock [s]; a twin that is behind its clock does not count."""
        self._held = ExitStack()

    def open(self) -> None:
        """Start all three."""
        with ExitStack() as held:
            self.twin = held.enter_context(WiredTwin(self._body, time.monotonic))
            self._connect(held)
            self._held = held.pop_all()

    def close(self) -> None:
        """Let go of everything. May be called twice."""
        self._held.close()

    @abstractmethod
    def look(self) -> None:
        """Take what the driver says, and judge it."""

    @abstractmethod
    def _connect(self, held: ExitStack) -> None:
        """Open the port and the driver, held open."""
