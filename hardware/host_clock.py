"""The computer's monotonic clock: the time of a robot that is real."""

from __future__ import annotations

import time

from hardware.errors import HardwareError, NotOpenError


class HostClock:
    """The computer's monotonic clock. Implements `hardware.hal.Clock`."""

    def __init__(self) -> None:
        self.running = False

    def now(self) -> float:
        """Time [s]; its zero is the computer's."""
        return time.monotonic()

    def sleep_until(self, t: float) -> bool:
        """Wait until `t` [s].

        Raises:
            NotOpenError: outside the robot's `open()` .. `close()`.
            HardwareError: `t` is not a time.
        """
        self.require()
        if not t < float("inf"):
            raise HardwareError(f"cannot sleep until {t}; give a finite time")
        while (left := t - time.monotonic()) > 0.0:
            time.sleep(left)
        return True

    def require(self) -> None:
        """Be open.

        Raises:
            NotOpenError: the robot is not.
        """
        if not self.running:
            raise NotOpenError
