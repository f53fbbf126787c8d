"""`twin experiment disturbance`: document B's corridor and meeting room, as they were mapped and after they were disturbed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from tyro.conf import arg

from scripts.experiments.arena import mae, mapped
from scripts.experiments.contest import Run
from scripts.experiments.document_b import DISTURBANCE, DocumentBOptions
from scripts.experiments.drive import Course
from scripts.options import parse

QUIET, DISTURBED = "as mapped", "disturbed"


@dataclass(frozen=True)
class DisturbanceOptions(DocumentBOptions):
    """Tour a corridor and a meeting room twice and localise by every method on the same recordings: once as they were mapped, once with
    all doors open, furniture moved and people walking.
    """

    duration: Annotated[float, arg(metavar="S")] = 205.0
    """Length of a drive [s]; the office's tour takes 200."""
    people: Annotated[int, arg(metavar="N")] = 4
    """How many walk about."""
    moved: Annotated[float, arg(metavar="SHARE")] = 0.3
    """Share of the furniture that stands elsewhere."""


def main(argv: list[str]) -> int:
    """Map, drive, localise, print; returns the exit code.

    Raises:
        UsageError, SimError, WorldError, SlamError, OutputError: with one line that says what to do.
    """
    options = parse(DisturbanceOptions, argv, "experiment disturbance")
    options.check(options.duration)
    disturbed = f"office:people={options.people},moved={options.moved:g},doors=open"
    contests = options.contests(
        lambda seed: mapped("office:people=0", options.duration, seed),
        lambda seed: {
            QUIET: Course("office:people=0", options.duration, seed),
            DISTURBED: Course(f"{disturbed},seed={seed}", options.duration, seed),
        },
    )
    contests.show("document B, corridor and meeting room", DISTURBANCE, options.out, *growth(contests.runs))
    return 0


def growth(runs: Sequence[Run]) -> list[str]:
    """How much the mean errors of every method grow by the disturbance, at the worst seed."""
    lines: list[str] = []
    for method in dict.fromkeys(run.method for run in runs):
        quiet, disturbed = ({run.seed: run for run in runs if run.method == method and run.condition == c} for c in (QUIET, DISTURBED))
        grown = np.array([_mean_errors(disturbed[seed]) - _mean_errors(quiet[seed]) for seed in quiet])
        x, y, yaw = grown.max(axis=0)
        lines.append(f"{method}: mean error grows by {100 * x:.2f} cm in x, {100 * y:.2f} cm in y, {math.degrees(yaw):.2f} deg at most")
    return lines


def _mean_errors(run: Run) -> np.ndarray:
    return np.array([mae(run.errors.x), mae(run.errors.y), mae(run.errors.yaw)])
