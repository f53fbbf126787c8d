"""The verb `twin experiment`: the source documents' experiments, repeated with ground truth."""

from __future__ import annotations

import importlib

from scripts.errors import UsageError

HELP = "repeat an experiment of the source documents with ground truth: icp"

EXPERIMENTS = {"icp": "scan-to-scan ICP: ways to choose correspondences, compared on one drive"}
"""name -> what it shows; each is one file in scripts/experiments."""


def main(argv: list[str]) -> int:
    """Run the experiment named first; returns the exit code.

    Raises:
        UsageError: no such experiment.
    """
    if not argv or argv[0] in ("-h", "--help"):
        lines = [f"  {name:12} {about}" for name, about in EXPERIMENTS.items()]
        print("\n".join(["usage: twin experiment NAME [options]", "", *lines, "", "`twin experiment NAME --help` explains one."]))
        return 0
    name, *rest = argv
    if name not in EXPERIMENTS:
        raise UsageError(f"no experiment '{name}'; available: {', '.join(sorted(EXPERIMENTS))}")
    return importlib.import_module(f"scripts.experiments.{name}").main(rest)
