"""One figure."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """A figure, the peer measured in the same run where there is one, and the command that prints it."""

    group: str
    name: str
    value: float
    unit: str
    reach: str = ""
    """What is asked for."""
    peer: str = ""
    peer_value: float | None = None
    ratio: float | None = None
    """How many times better than the peer."""

    @property
    def command(self) -> str:
        """What prints this figure."""
        return f"twin bench {self.group}"


def median_time(work: Callable[[], object], repeats: int) -> float:
    """Median wall time of `work` [s], after one warm-up."""
    work()
    times: list[float] = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return statistics.median(times)
