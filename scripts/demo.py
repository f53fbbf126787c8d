"""The verb `twin demo`: the main job, with nothing to decide."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from scripts.options import parse
from scripts.runs.execute import execute
from scripts.runs.options import RunOptions
from scripts.runs.summary import summary

HELP = "a 60 s tour of aruco_room in simulation: map, trajectories, errors, report and GIF"

INTERRUPTED = 130


@dataclass(frozen=True)
class DemoOptions:
    """Drive the LEGO robot round a room in simulation, map it with the lidar, and compare with the truth."""

    seed: int = 0
    """Seed of all noise."""
    out: Path = Path("runs/demo")
    """Folder for the results."""


def main(argv: list[str]) -> int:
    """Run; returns the exit code."""
    options = parse(DemoOptions, argv, "demo")
    run = execute(RunOptions(seed=options.seed, out=options.out, record=True))
    print("\n".join(summary(run)))
    return INTERRUPTED if run.interrupted else 0
