"""The verb `twin icp`: how ICP lays one scan over another, step by step.

Without a recording it repeats the check of the source report: the points of a scan, moved by (1 m, 2 m, 30 deg), are
brought back from where they are, without a guess. With `--log PATH --scans TARGET SOURCE` it registers two scans of a
recording, starting from what the wheels say.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from scripts.errors import UsageError
from scripts.icp_animation import write_icp_gif, write_icp_png
from scripts.options import parse
from scripts.scan_pairs import ScanPair, displaced_room, recorded_pair
from slam.matching.icp import Icp, IcpStep
from slam.matching.match import Match
from slam.se2 import SE2

HELP = "lay one scan over another by ICP, step by step: table, GIF, and the check of the source report"

MOST_ROWS = 14
CHECK_TOLERANCE = 1e-6
"""[m] and [rad]"""


@dataclass(frozen=True)
class IcpOptions:
    """Lay one scan over another by ICP. Without --log: the check of the source report, a scan moved by (1 m, 2 m, 30 deg)."""

    log: Path | None = None
    """Recording to take two scans from, of any format that `twin run --robot replay:` reads."""
    scans: tuple[int, int] = (0, 10)
    """With --log: numbers of the target scan and of the source scan that is laid over it, counted from 0."""
    gif: Path | None = None
    """Animation of the steps to write."""
    png: Path | None = None
    """Picture of the start and the end to write."""
    check: bool = False
    """Exit with 1 unless the answer of the check is right to 1e-6 m and rad."""
    iterations: int = Icp.__dataclass_fields__["iterations"].default
    """Most steps."""
