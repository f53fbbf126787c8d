"""`twin experiment crowd`: document C among people, in its badly mapped region A, and in both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from rich.console import Console
from rich.table import Table

from hardware.camera_spec import d435
from hardware.spec import RobotSpec
from scripts.experiments.contest import Run, contest
from scripts.experiments.drive import Course, Drive
from scripts.experiments.office_parts import PlacedMap, by_parts, drift_along_corridor
from scripts.experiments.paper_table import PaperFigures, grouped, paper_table, write_results
from scripts.experiments.people_options import PeopleOptions
from scripts.experiments.structured import document_c
from scripts.options import parse

PEOPLE = "people=5"
CONDITIONS = {
    "people": f"office:{PEOPLE}",
    "A moved": "office:people=0,displaced=true",
    "both": f"office:{PEOPLE},displaced=true",
}
"""What is special -> world of the drive, to which the seed of the people is added."""
PAPER = {"classic": PaperFigures(worst_cm=10.0), "method": PaperFigures(worst_cm=5.0)}
CAMERA = replace(d435((424, 240), (424, 240), rate=6), period=0.25)
"""Small pictures, four a second, so that a drive's fit in the memory."""


@dataclass(frozen=True)
class CrowdOptions(PeopleOptions):
    """Five people walk about the office, region A stands elsewhere than in the map, or both; every method sees the same recordings."""

    camera: bool = True
    """Whether the robot has its camera, which takes most of the time."""
    spec: RobotSpec = field(default_factory=lambda: RobotSpec(camera=CAMERA), init=False)


def main(argv: list[str]) -> int:
    """Map, drive, localise, print; returns the exit code.

    Raises:
        UsageError, SimError, WorldError, OutputError: with one line that says what to do.
    """
    options = parse(CrowdOptions, argv, "experiment crowd")
    options.check()
    placed = PlacedMap.made()
    runs: list[Run] = []
    drifts: dict[tuple[str, str], list[float]] = {}
    for condition, world in CONDITIONS.items():
        for seed in options.seeds:
            drive = record(options, world, seed)
            here = contest(placed.given, drive, seed, document_c(), condition)
            for run in here:
                drifts.setdefault((run.method, condition), []).append(float(np.max(drift_along_corridor(run, drive), initial=0.0)))
            runs += here
    console = Console(width=170)
    console.print(paper_table("document C, crowd, scored by where the map lies", by_parts(runs), PAPER))
    own = [placed.in_place(run) for run in runs]
    console.print(paper_table("the same against where each room lies in the map: without the map's own errors", by_parts(own)))
    console.print(_drift_table(runs, drifts))
    if options.out is not None:
        for condition in CONDITIONS:
            some = [run for run in runs if run.condition == condition]
            write_results(options.out / condition.replace(" ", "_"), f"document C: {condition}", some, placed.given)
    return 0


def record(options: CrowdOptions, world: str, seed: int) -> Drive:
    """A drive among people who walk elsewhere with every seed."""
    camera = "raster" if options.camera else "none"
    return Course(f"{world},seed={seed}", options.duration, seed, camera=camera, spec=options.spec).drive()


def _drift_table(runs: Sequence[Run], drifts: dict[tuple[str, str], list[float]]) -> Table:
    table = Table(
        "method", "on", r"worst drift along the corridor \[cm]", "of odometry's", title="from where each stretch of the corridor began"
    )
    for method, condition in grouped(runs):
        own, odometry = drifts[method, condition], drifts["odometry", condition]
        ratios = [a / max(b, 1e-3) for a, b in zip(own, odometry, strict=True)]
        table.add_row(method, condition, f"{100.0 * np.median(own):.1f} ({100.0 * max(own):.1f})", f"{np.median(ratios):.2f}")
    return table
