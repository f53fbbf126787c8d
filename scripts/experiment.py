"""The verb `twin experiment`: the source documents' experiments, repeated with ground truth, and trials of robustness."""

from __future__ import annotations

import importlib

from scripts.errors import UsageError

HELP = "repeat an experiment of the source documents, or put localization to the test, with ground truth"

EXPERIMENTS = {
    "icp": "document A: scan-to-scan ICP, ways to choose correspondences, compared on one drive",
    "amcl_turns": "document A: AMCL that turns on the spot, on a map and odometry from ICP",
    "hall": "document B: the tour of a hall, from lidar and from the depth camera alone",
    "corridor": "document B: a corridor there and back, and the time of a pose against a particle filter",
    "disturbance": "document B: corridor and meeting room, before and after doors, furniture and people have changed them",
    "structured": "document C: the fixed tour through a structured world, and its badly mapped region A",
    "crowd": "document C: five people, region A moved, and both",
    "kidnap": "robots that are carried away, and false alarms of robots that are not",
    "furniture": "a share of the furniture moved, anew for every run: how often amcl is lost",
    "markers": "document A: marker maps, markers 15 to 150 cm apart, turning or along the walls, chained or as a graph",
    "convergence": "document C: how the particles' spread falls after an uncertain start",
    "explore": "unattended exploration of the frozen maps with SLAM in the loop: how many are mapped, hangs, collisions",
}
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
