"""The verb `twin run`: any robot, any pipeline, one folder with the answer."""

from __future__ import annotations

from scripts.options import parse
from scripts.runs.options import RunOptions

HELP = "drive a robot or replay a recording, estimate, and write a folder with map, trajectories, metrics and pictures"


def main(argv: list[str]) -> int:
    """Run; returns the exit code."""
    options = parse(RunOptions, argv, "run")
    from scripts.runs.summary import conclude  # late: options and their mistakes are answered before Numba is loaded

    return conclude(options)
