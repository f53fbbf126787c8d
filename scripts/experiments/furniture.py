"""`twin experiment furniture`: a share of the furniture stands elsewhere than when the map was made, anew for every run."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from rich.console import Console
from rich.table import Table
from tyro.conf import arg

from scripts.errors import UsageError
from scripts.experiments.arena import WorldErrors, errors_in, follow, mapped, start_in
from scripts.experiments.drive import Course
from scripts.options import parse
from slam.localization.amcl import Amcl

MAPPING_TIME, MAPPING_SEED = 210.0, 100
ASTRAY = 0.5
"""Error from which a robot is lost [m]."""


@dataclass(frozen=True)
class FurnitureOptions:
    """Map a world, then follow its tour with furniture moved up to 0.5 m and 90 deg, elsewhere in every run, localised by `amcl`."""

    world: str = "office"
    """Where; it takes the options `moved` and `seed`."""
    runs: Annotated[int, arg(metavar="N")] = 100
    """How many."""
    moved: Annotated[float, arg(metavar="SHARE")] = 0.3
    """Share of the furniture that is moved."""
    duration: Annotated[float, arg(metavar="S")] = 60.0
    """Length of a run [s]; the office's tour takes 200."""
    seed: int = 1000
    """Of the first run."""

    def check(self) -> None:
        """Raise UsageError where an option makes no sense."""
        if self.runs < 1 or self.seed < 0:
            raise UsageError("--runs: 1 or above; --seed: 0 or above")
        if not 0.0 <= self.moved <= 1.0:
            raise UsageError(f"--moved {self.moved:g}: give a share, 0 to 1")
        if not (math.isfinite(self.duration) and self.duration >= 2.0):
            raise UsageError(f"--duration {self.duration:g}: give at least 2 seconds")


def main(argv: list[str]) -> int:
    """Map, drive, localise, print; returns the exit code.

    Raises:
        UsageError, SimError, WorldError: with one line that says what to do.
    """
    options = parse(FurnitureOptions, argv, "experiment furniture")
    options.check()
    began = time.process_time()
    errors = drives(options)
    worst = np.array([one.position.max() for one in errors])
    table = Table("runs", "lost", "worst error, median", "of all runs", "RMSE, median", "seeds of the lost")
    rmse = np.median([math.sqrt(float(np.mean(np.square(one.position)))) for one in errors])
    lost = [str(options.seed + k) for k in np.flatnonzero(worst >= ASTRAY).tolist()]
    cells = (f"{100.0 * np.median(worst):.1f} cm", f"{100.0 * worst.max():.1f} cm", f"{100.0 * rmse:.1f} cm", ", ".join(lost))
    table.add_row(str(len(errors)), str(len(lost)), *cells)
    console = Console(width=150)
    console.print(table)
    console.print(f"{time.process_time() - began:.0f} s of processor time")
    return 0


def drives(options: FurnitureOptions) -> list[WorldErrors]:
    """Errors of every run."""
    separator = "," if ":" in options.world else ":"
    given = mapped(options.world, MAPPING_TIME, MAPPING_SEED)
    errors: list[WorldErrors] = []
    for seed in range(options.seed, options.seed + options.runs):
        drive = Course(f"{options.world}{separator}moved={options.moved:g},seed={seed}", options.duration, seed).drive()
        outcome = follow(Amcl().build(given.known, start_in(given, drive)), drive)
        errors.append(errors_in(given, drive, outcome.estimate))
    return errors
