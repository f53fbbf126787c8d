"""How far the stamps of scans are from the time at which the twin's lidar really was at its first beam."""

from __future__ import annotations

import time

import numpy as np

from scripts.bench.row import Row
from scripts.bench.wire import SMOKE
from scripts.bench.wire.lidar_trial import LidarTrial

LASTS = 60.0
"""[s]"""


def run(smoke: bool) -> list[Row]:
    """Of every scan in a minute."""
    return rows(SMOKE if smoke else LASTS)


def rows(seconds: float) -> list[Row]:
    """Of every scan in a stretch of time [s]."""
    with LidarTrial() as trial:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            trial.look()
            time.sleep(0.05)
        errors = 1e3 * np.abs(trial.stamp_errors)
    return [
        Row("wire", f"stamp of a scan against the truth, worst of {len(errors)}", float(max(errors, default=np.inf)), "ms", "≤ 5"),
        Row("wire", "stamp of a scan against the truth, median", float(np.median(errors)), "ms"),
    ]
