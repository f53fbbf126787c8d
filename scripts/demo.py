"""The verb `twin demo`: the main job, with nothing to decide."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from scripts.options import parse
from scripts.runs.options import RunOptions

HELP = "a 60 s tour of aruco_room in simulation: map, trajectories, errors, report and GIF"


@dataclass(frozen=True)
class DemoOptions:
    """Drive the LEGO robot round a room in simulation for 60 s, map it with the lidar, and compare with the truth.

    It is `twin run --record`; `twin run --help` says what else can be chosen. Ctrl-C ends it early and writes what there is.
    """

    seed: Annotated[int, arg(metavar="N")] = 0
    """Seed of all noise, 0 or above: the same seed gives the same run, bit for bit."""
    out: Annotated[Path, arg(metavar="FOLDER")] = Path("runs/demo")
    """Folder for the results, made if missing; results of an earlier run in it are replaced."""


def main(argv: list[str]) -> int:
    """Run; returns the exit code."""
    options = parse(DemoOptions, argv, "demo")
    from scripts.runs.summary import conclude  # late: options and their mistakes are answered before Numba is loaded

    return conclude(RunOptions(seed=options.seed, out=options.out, record=True))
