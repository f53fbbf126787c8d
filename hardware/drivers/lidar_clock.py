"""The lidar's millisecond counter on the host's clock."""

from __future__ import annotations

import math

from hardware.protocols.scip_sweep import WRAP_MS

WINDOW = 50
"""Scans over which the quickest arrival is looked for: five seconds."""
DRIFT_LIMIT = 0.01
"""More than this from one window to the next is no drift of a clock [s]."""


class LidarClock:
    """Offset by the exchange of times, then kept by the quickest arrivals, for the clocks drift apart.

    A scan arrives a constant time after its stamp, or later. The quickest arrival of each window therefore shows how the offset moves.
    """

    def __init__(self, stamp_ms: int, host: float) -> None:
        """The counter shows `stamp_ms` at `host` [s]."""
        self._last_ms = stamp_ms
        self._offset = host - stamp_ms * 1e-3
        self._delays: list[float] = []
        self._usual: float | None = None

    def host_time(self, stamp_ms: int) -> float:
        """Time of a stamp on the host's clock [s]; stamps may lie up to half a turn of the counter apart."""
        step = (stamp_ms - self._last_ms + WRAP_MS // 2) % WRAP_MS - WRAP_MS // 2
        self._last_ms += step
        return self._offset + self._last_ms * 1e-3

    def observe(self, stamp: float, arrival: float) -> None:
        """Learn from a scan of host time `stamp` that arrived at `arrival` [s]."""
        self._delays.append(arrival - stamp)
        if len(self._delays) < WINDOW:
            return
        quickest, self._delays = min(self._delays), []
        if self._usual is None:
            self._usual = quickest
        elif abs(quickest - self._usual) < DRIFT_LIMIT:
            self._offset += quickest - self._usual


def best_offset(samples: list[tuple[float, int, float]]) -> tuple[int, float]:
    """Counter and host time that belong together, from (send, counter, receive): of the quicker half of the exchanges.

    The counter shows whole milliseconds, half of one is added for the mean.
    """
    quick = sorted(samples, key=lambda sample: sample[2] - sample[0])[: max(len(samples) // 2, 1)]
    first = quick[0][1]
    host = [
        0.5 * (sent + received) - ((counter - first + WRAP_MS // 2) % WRAP_MS - WRAP_MS // 2) * 1e-3 for sent, counter, received in quick
    ]
    return first, math.fsum(host) / len(host) - 0.5e-3
