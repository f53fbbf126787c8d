"""The verb `twin run`: any robot, any pipeline, one folder with the answer."""

from __future__ import annotations

from scripts.options import parse
from scripts.runs.execute import execute
from scripts.runs.options import RunOptions
from scripts.runs.summary import summary

HELP = "drive a robot or replay a recording, estimate, and write a folder with map, trajectories, metrics and pictures"

INTERRUPTED = 130


def main(argv: list[str]) -> int:
    """Run; returns the exit code."""
    run = execute(parse(RunOptions, argv, "run"))
    print("\n".join(summary(run)))
    return INTERRUPTED if run.interrupted else 0
