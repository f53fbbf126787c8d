"""`twin experiment convergence`: document C's figure 7, how the spread of the particles falls after an uncertain start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
from rich.console import Console
from rich.table import Table

from scripts.experiments.arena import start_in
from scripts.experiments.contest import Method, Run, contest
from scripts.experiments.drive import Course
from scripts.experiments.office_parts import EMPTY_OFFICE, PlacedMap
from scripts.experiments.paper_table import grouped, write_results
from scripts.experiments.people_options import PeopleOptions
from scripts.experiments.structured import document_c
from scripts.options import parse
from slam.se2 import SE2

START = 0.5
"""Standard deviation of the start [m, rad]."""
OFF = SE2(0.4, -0.2, 0.3)
"""How wrong the start is."""
SETTLED = 0.1
"""Spread from which a filter has converged [m]."""
MOMENTS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
"""[s]"""


@dataclass(frozen=True)
class ConvergenceOptions(PeopleOptions):
    """Start half a metre and 17 deg wrong, with particles spread by 0.5 m and 0.5 rad, and watch spread and error fall."""

    duration: float = 30.0
    """Length of a drive [s]."""


def main(argv: list[str]) -> int:
    """Map, drive, localise, print; returns the exit code.

    Raises:
        UsageError, SimError, WorldError, OutputError: with one line that says what to do.
    """
    options = parse(ConvergenceOptions, argv, "experiment convergence")
    options.check()
    placed = PlacedMap.made()
    runs: list[Run] = []
    for seed in options.seeds:
        drive = Course(EMPTY_OFFICE, options.duration, seed).drive()
        start = start_in(placed.given, drive) @ OFF
        runs += contest(placed.given, drive, seed, uncertain(document_c()), start=start)
    Console(width=150).print(_table(runs))
    if options.out is not None:
        write_results(options.out, "document C: convergence of the spread", runs, placed.given)
    return 0


def uncertain(chosen: Mapping[str, Method]) -> dict[str, Method]:
    """Those that know of an uncertain start, with one."""
    told = {name: {field.name for field in fields(settings)} for name, settings in chosen.items()}
    spread = {"start_position": START, "start_yaw": START}
    return {name: replace(settings, **spread) for name, settings in chosen.items() if set(spread) <= told[name]}


def _table(runs: list[Run]) -> Table:
    title = r"spread of the position along its worst axis \[cm] / error \[cm], median over the seeds"
    table = Table("method", r"converged after \[s]", *(f"{t:g} s" for t in MOMENTS), title=title, title_justify="left")
    for (method, _), some in grouped(runs).items():
        cells: list[str] = []
        for t in MOMENTS:
            at = [min(int(np.searchsorted(run.errors.stamps - run.errors.stamps[0], t)), len(run.lost) - 1) for run in some]
            spread = np.median([run.deviations[i, 0] for run, i in zip(some, at, strict=True)])
            error = np.median([run.errors.position[i] for run, i in zip(some, at, strict=True)])
            cells.append(f"{100.0 * spread:.1f} / {100.0 * error:.1f}")
        table.add_row(method, f"{np.median([settling_time(run) for run in some]):.1f}", *cells)
    return table


def settling_time(run: Run) -> float:
    """Time [s] from which on the spread stays below `SETTLED`; inf where it does not."""
    above = np.flatnonzero(run.deviations[:, 0] >= SETTLED)
    last = int(above[-1]) + 1 if len(above) else 0
    return float(run.errors.stamps[last] - run.errors.stamps[0]) if last < len(run.lost) else float("inf")
