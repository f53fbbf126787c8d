"""The verb `twin print`: markers and boards on paper, at true scale."""

from __future__ import annotations

import importlib

from scripts.errors import UsageError

HELP = "write markers or a board for a camera's calibration as a PDF at true scale"

PRINTS = {"markers": "ArUco and AprilTag markers, several on a sheet", "board": "a ChArUco board or a chessboard"}
"""name -> what it is; each is one file in scripts/prints."""


def main(argv: list[str]) -> int:
    """Write the print named first; returns the exit code.

    Raises:
        UsageError: no such print.
    """
    if not argv or argv[0] in ("-h", "--help"):
        lines = [f"  {name:12} {about}" for name, about in PRINTS.items()]
        print("\n".join(["usage: twin print NAME [options]", "", *lines, "", "`twin print NAME --help` explains one."]))
        return 0
    name, *rest = argv
    if name not in PRINTS:
        raise UsageError(f"nothing called '{name}' to print; available: {', '.join(sorted(PRINTS))}")
    return importlib.import_module(f"scripts.prints.{name}").main(rest)
