"""`twin experiment corridor`: document B's corridor there and back, and how long a pose takes against a particle filter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from tyro.conf import arg

from scripts.experiments.arena import mapped
from scripts.experiments.contest import Run
from scripts.experiments.document_b import CORRIDOR, DocumentBOptions
from scripts.experiments.drive import Course
from scripts.options import parse
from slam.localization.amcl import Amcl
from slam.localization.belief import Filtering
from slam.localization.resampling import Kld
from slam.motion.keyframes import KeyframeGate

RATIO = 0.63
"""Of the document's times: 13.7 ms for perfect match, 21.8 ms for its particle filter."""
FILTER = "amcl 2000"
"""`amcl` with 2 000 particles, which looks at all valid beams at every scan, as perfect match does."""
PAIR = ("perfect_match", FILTER)


@dataclass(frozen=True)
class CorridorOptions(DocumentBOptions):
    """Drive along a corridor of 14.0 x 1.32 m and back, and localise by every method on the same recordings."""

    duration: Annotated[float, arg(metavar="S")] = 105.0
    """Length of a drive [s]; there and back takes 100."""


def main(argv: list[str]) -> int:
    """Map, drive, localise, print; returns the exit code.

    Raises:
        UsageError, SimError, WorldError, SlamError, OutputError: with one line that says what to do.
    """
    options = parse(CorridorOptions, argv, "experiment corridor")
    options.check(options.duration)
    contests = options.contests(
        lambda seed: mapped("corridor", options.duration, seed),
        lambda seed: {"": Course("corridor", options.duration, seed)},
        **{FILTER: every_scan()},
    )
    contests.show("document B, corridor there and back", CORRIDOR, options.out, _times(contests.runs))
    return 0


def every_scan() -> Amcl:
    """The opponent: 2 000 particles, weighed by all valid beams whenever a scan comes."""
    return Amcl(filtering=Filtering(sample_size=Kld(2000, 2000)), update=KeyframeGate(0.0, 0.0))


def _times(runs: list[Run]) -> str:
    """Time of a pose against the filter's, over all seeds."""
    ours, theirs = (np.concatenate([run.update_ms for run in runs if run.method == name] or [np.full(1, np.nan)]) for name in PAIR)
    return (
        f"time a pose: perfect_match {np.median(ours):.2f} ms, {FILTER} {np.median(theirs):.2f} ms, "
        f"ratio {np.median(ours) / np.median(theirs):.2f}; the document's {RATIO:.2f}"
    )
