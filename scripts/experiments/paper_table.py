"""The papers' tables: MAE and RMSE in x, y and yaw apart, the worst error and the time of a pose, beside what the paper reports."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.table import Table

from scripts.experiments.arena import mae, rmse
from scripts.experiments.contest import Run
from scripts.experiments.paper_plot import write_errors_png
from scripts.runs.files import write_text
from scripts.runs.known_map import GivenMap

CM = 100.0


@dataclass(frozen=True, slots=True)
class PaperFigures:
    """What a paper reports of a method; nan where it says nothing."""

    mae: tuple[float, float, float] = (math.nan,) * 3
    """x, y [cm], yaw [rad]."""
    rmse: tuple[float, float, float] = (math.nan,) * 3
    """x, y [cm], yaw [rad]."""
    worst_cm: float = math.nan
    milliseconds: float = math.nan


Figure = Callable[[Run], float]

FIGURES: dict[str, tuple[Figure, str]] = {
    "MAE x [cm]": (lambda run: CM * mae(run.errors.x), ".1f"),
    "MAE y [cm]": (lambda run: CM * mae(run.errors.y), ".1f"),
    "MAE yaw [rad]": (lambda run: mae(run.errors.yaw), ".4f"),
    "RMSE x [cm]": (lambda run: CM * rmse(run.errors.x), ".1f"),
    "RMSE y [cm]": (lambda run: CM * rmse(run.errors.y), ".1f"),
    "RMSE yaw [rad]": (lambda run: rmse(run.errors.yaw), ".4f"),
    "worst [cm]": (lambda run: CM * float(np.max(run.errors.position, initial=0.0)), ".1f"),
    "lost [%]": (lambda run: 100.0 * float(np.mean(run.lost)) if len(run.lost) else 0.0, ".1f"),
    "ms a pose": (lambda run: float(np.median(run.update_ms)) if len(run.update_ms) else math.nan, ".2f"),
}
"""heading -> figure of a run, and how it is written."""


def figures_of(runs: Sequence[Run]) -> dict[str, tuple[float, float]]:
    """Median and worst over the runs of one method, by heading."""
    values = {heading: [figure(run) for run in runs] for heading, (figure, _) in FIGURES.items()}
    return {heading: (float(np.median(some)), float(np.max(some))) for heading, some in values.items()}


def paper_table(title: str, runs: Sequence[Run], paper: Mapping[str, PaperFigures] | None = None) -> Table:
    """A row for each method and condition, median over the seeds and the worst of them in brackets; below them the paper's own rows."""
    table = Table(title=title, title_justify="left")
    for heading in ("method", "on", "runs"):
        table.add_column(heading)
    for heading in FIGURES:
        table.add_column(heading.replace("[", r"\["), justify="right")
    for (method, condition), some in grouped(runs).items():
        cells = [_cell(value, len(some), form) for value, (_, form) in zip(figures_of(some).values(), FIGURES.values(), strict=True)]
        table.add_row(method, condition, str(len(some)), *cells)
    table.add_section()
    for name, figures in (paper or {}).items():
        numbers = (*figures.mae, *figures.rmse, figures.worst_cm, math.nan, figures.milliseconds)
        table.add_row(f"paper: {name}", "", "", *("" if math.isnan(number) else f"{number:g}" for number in numbers))
    return table


def grouped(runs: Iterable[Run]) -> dict[tuple[str, str], list[Run]]:
    """Runs by method and condition, in the order in which they come."""
    groups: dict[tuple[str, str], list[Run]] = {}
    for run in runs:
        groups.setdefault((run.method, run.condition), []).append(run)
    return groups


def write_results(folder: Path, title: str, runs: Sequence[Run], given: GivenMap) -> None:
    """Write `table.csv` (a row for each run), `errors.csv` (all errors over time) and `errors.png` into a folder, which is made.

    Raises:
        OutputError: a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rows = [[run.method, run.condition, run.seed, *(f"{figure(run):.6g}" for figure, _ in FIGURES.values())] for run in runs]
    write_text(folder / "table.csv", _csv([["method", "condition", "seed", *FIGURES], *rows]))
    write_text(folder / "errors.csv", _csv([ERROR_COLUMNS, *(row for run in runs for row in _error_rows(run))]))
    write_errors_png(folder / "errors.png", title, runs, given)


ERROR_COLUMNS = ["method", "condition", "seed", "stamp_s", "x_m", "y_m", "yaw_rad", "claimed_position_m", "claimed_yaw_rad", "lost"]


def _error_rows(run: Run) -> Iterable[list[object]]:
    columns = (run.errors.stamps, run.errors.x, run.errors.y, run.errors.yaw, *run.deviations.T, run.lost)
    for row in zip(*columns, strict=True):
        yield [run.method, run.condition, run.seed, *(f"{value:.5g}" for value in row)]


def _cell(figure: tuple[float, float], count: int, form: str) -> str:
    median, worst = figure
    return f"{median:{form}}" if count == 1 else f"{median:{form}} ({worst:{form}})"


def _csv(rows: Iterable[Sequence[object]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
