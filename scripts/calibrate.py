"""The verb `twin calibrate`: what has to be measured once before a sensor can be trusted."""

from __future__ import annotations

import importlib

from scripts.errors import UsageError

HELP = "measure a camera's lens, from photographs of a board, from a film or from a robot"

CALIBRATIONS = {"camera": "K and distortion of a camera, from a ChArUco board or a chessboard"}
"""name -> what it measures; each is one file in scripts/calibrations."""


def main(argv: list[str]) -> int:
    """Run the calibration named first; returns the exit code.

    Raises:
        UsageError: no such calibration.
    """
    if not argv or argv[0] in ("-h", "--help"):
        lines = [f"  {name:12} {about}" for name, about in CALIBRATIONS.items()]
        print("\n".join(["usage: twin calibrate NAME [options]", "", *lines, "", "`twin calibrate NAME --help` explains one."]))
        return 0
    name, *rest = argv
    if name not in CALIBRATIONS:
        raise UsageError(f"nothing called '{name}' to calibrate; available: {', '.join(sorted(CALIBRATIONS))}")
    return importlib.import_module(f"scripts.calibrations.{name}").main(rest)
