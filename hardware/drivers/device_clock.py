"""A device's clock on the host's, by exchanges of times."""

from __future__ import annotations

from collections import deque


class DeviceClock:
    """Goes by the quickest of the last exchanges: its answer was on the way for the least time, there and back."""

    def __init__(self, kept: int = 50) -> None:
        """Know nothing yet; later exchanges push out those before the last `kept`."""
        self._exchanges: deque[tuple[float, float]] = deque(maxlen=kept)

    @property
    def known(self) -> bool:
        """Whether times have been exchanged."""
        return bool(self._exchanges)

    def observe(self, sent: float, device: float, received: float) -> None:
        """A question of host time `sent` was answered at `received` [s]; in between the device's clock said `device` [s]."""
        self._exchanges.append((received - sent, 0.5 * (sent + received) - device))

    def host_time(self, device: float) -> float:
        """A time of the device on the host's clock [s]."""
        return device + min(self._exchanges)[1]
