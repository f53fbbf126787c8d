"""The papers' pictures: where every method believed to be, its error and what it claimed, over time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scripts.experiments.contest import Run, first_seed, path_in_world, walls_in_world
from scripts.runs import palette
from scripts.runs.files import write_via
from scripts.runs.known_map import GivenMap

SIZE_INCHES, DPI = (16.0, 9.0), 110
COLOURS = ("#ee8a1d", "#1d5fd1", "#d6336c", "#7048e8", "#0b7285", "#5c940d", "#a61e4d", "#495057")
LEGEND_COLUMNS = 6
STYLES = ("-", "--", ":", "-.")
ODOMETRY_SHOWN = 3.0
"""The axes of errors reach at most so many times as high as all other methods need, where odometry drifts away."""


def write_errors_png(path: Path, title: str, runs: Sequence[Run], given: GivenMap) -> None:
    """Draw the runs of the lowest seed: the map with all paths, errors of position and heading, and the deviations claimed.

    Raises:
        OutputError: the file cannot be written.
    """
    runs = first_seed(runs)
    figure = Figure(figsize=SIZE_INCHES, dpi=DPI, facecolor=palette.PAGE, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    figure.suptitle(title, x=0.02, ha="left", size=18, weight="bold", color=palette.INK)
    panels = figure.subplot_mosaic([["map", "position"], ["map", "heading"], ["map", "claimed"]], width_ratios=(1.0, 1.0))
    _draw_map(panels["map"], runs, given)
    _draw_lines(panels["position"], "position error [cm]", runs, [100.0 * run.errors.position for run in runs])
    _draw_lines(panels["heading"], "heading error [deg]", runs, [np.degrees(np.abs(run.errors.yaw)) for run in runs])
    _draw_lines(panels["claimed"], "claimed deviation of the position [cm]", runs, [100.0 * run.deviations[:, 0] for run in runs])
    panels["claimed"].set_xlabel("time [s]", color=palette.MUTED)
    figure.legend(*panels["position"].get_legend_handles_labels(), ncols=LEGEND_COLUMNS, frameon=False, loc="outside lower center")
    write_via(path, canvas.print_png)


def looks(runs: Sequence[Run]) -> list[tuple[str, str]]:
    """Colour and line style of each run: a colour for the method, a style for the condition."""
    names, conditions = list(dict.fromkeys(run.method for run in runs)), list(dict.fromkeys(run.condition for run in runs))
    return [(COLOURS[names.index(run.method) % len(COLOURS)], STYLES[conditions.index(run.condition) % len(STYLES)]) for run in runs]


def _draw_map(axes: Axes, runs: Sequence[Run], given: GivenMap) -> None:
    walls = walls_in_world(given)
    axes.plot(*walls.T, ".", ms=1.5, color=palette.OCCUPIED, zorder=1)
    for run, (colour, style) in zip(runs, looks(runs), strict=True):
        axes.plot(*path_in_world(run).T, style, color=colour, lw=1.2, zorder=3)
    for condition in dict.fromkeys(run.condition for run in runs):
        truth = next(run.places for run in runs if run.condition == condition)
        axes.plot(*truth[:, :2].T, color=palette.TRUTH_PALE, lw=4.5, zorder=2, label="truth" if condition == runs[0].condition else None)
    low, high = walls.min(axis=0) - 0.5, walls.max(axis=0) + 0.5
    axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")
    axes.legend(fontsize=9, frameon=False, loc="lower left")
    axes.spines[:].set_visible(False)


def _draw_lines(axes: Axes, title: str, runs: Sequence[Run], values: Sequence[np.ndarray]) -> None:
    for run, line, (colour, style) in zip(runs, values, looks(runs), strict=True):
        label = f"{run.method} {run.condition}".strip()
        axes.plot(run.errors.stamps, line, style, color=colour, lw=1.1, label=label)
    highest = [float(np.max(line, initial=0.0)) for run, line in zip(runs, values, strict=True) if run.method != "odometry"]
    top = max(highest, default=math.nan)
    if top > 0.0 and max(float(np.max(line, initial=0.0)) for line in values) > ODOMETRY_SHOWN * top:
        axes.set_ylim(0.0, ODOMETRY_SHOWN * top)
    axes.set_ylim(bottom=0.0)
    axes.set_title(title, loc="left", size=11, color=palette.INK)
    axes.margins(x=0.0)
    axes.grid(color=palette.UNKNOWN)
    axes.tick_params(colors=palette.MUTED, length=0)
    axes.spines[:].set_visible(False)
