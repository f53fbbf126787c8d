"""Options that document C's experiments have in common."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from tyro.conf import arg

from scripts.errors import UsageError
from scripts.options import OptionalFile


@dataclass(frozen=True)
class PeopleOptions:
    """Of all experiments of document C."""

    seeds: Annotated[tuple[int, ...], arg(metavar="N...")] = (1, 2, 3)
    """Seeds of the drives."""
    duration: Annotated[float, arg(metavar="S")] = 205.0
    """Length of a drive [s]; the office's tour takes 200."""
    out: OptionalFile = None
    """Write table, errors over time and their picture into this folder."""

    def check(self) -> None:
        """Raise UsageError where an option makes no sense."""
        if not self.seeds or min(self.seeds) < 0:
            raise UsageError("--seeds: give one or more integers, 0 or above")
        if not (math.isfinite(self.duration) and self.duration >= 2.0):
            raise UsageError(f"--duration {self.duration:g}: give at least 2 seconds")
