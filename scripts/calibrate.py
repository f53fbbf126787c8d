"""The verb `twin calibrate`: measure what the robot is, and write it where every verb can read it."""

from __future__ import annotations

import importlib

from scripts.errors import UsageError

HELP = "measure the robot: its wheels and its camera"

CALIBRATIONS = {
    "odometry": "wheel radii and track, from a drive with the lidar",
    "camera": "K and distortion of a camera, from a ChArUco board or a chessboard",
}
"""name -> what is measured; each is one file in scripts/calibrations."""


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
        raise UsageError(f"no calibration '{name}'; available: {', '.join(sorted(CALIBRATIONS))}")
    return importlib.import_module(f"scripts.calibrations.{name}").main(rest)
