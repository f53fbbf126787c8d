"""The drivers of the real robot over the emulators' own bytes: faults, endurance, stops, clocks, and SLAM through the wire."""

from __future__ import annotations

from scripts.bench.row import Row
from scripts.bench.wire import faults, slam, soak, stamps, stops

FAULTS, SOAK, STAMPS, TOUR = 600.0, 1800.0, 60.0, 60.0
"""How long each lasts [s]; faults befall every driver for so long."""
SMOKE = 5.0
"""Instead of all of them [s]."""


def run(smoke: bool) -> list[Row]:
    """All parts, one after the other; about 70 minutes, in the time of the world."""
    return [
        *stops.rows(1 if smoke else 5),
        *stamps.rows(SMOKE if smoke else STAMPS),
        *faults.rows(SMOKE if smoke else FAULTS),
        *soak.rows(SMOKE if smoke else SOAK),
        *slam.rows(range(1, 2 if smoke else 4), SMOKE if smoke else TOUR),
    ]
