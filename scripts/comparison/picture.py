"""`compare.png`: all paths on the true walls, and all errors over time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, StrMethodFormatter

from scripts.runs import palette
from scripts.runs.curves import Curve, curves
from scripts.runs.files import write_via
from scripts.runs.record import RunRecord
from scripts.runs.scene import Scene, lay_out

COLOURS = ("#1d5fd1", "#ee8a1d", "#d6336c", "#7a4fd0", "#12a5b8", "#8a6d3b", "#5d6b78", "#c2b100")
"""One for each run, round and round; the truth has its own."""
SIZE_INCHES, DPI = (16.0, 9.0), 120
MOST_POINTS = 4000


def colours(records: Mapping[str, RunRecord]) -> dict[str, str]:
    """Run -> its colour."""
    return {name: COLOURS[k % len(COLOURS)] for k, name in enumerate(records)}


def write_picture(path: Path, records: Mapping[str, RunRecord]) -> None:
    """Write the picture, 1920 x 1080.

    Raises:
        OutputError: the file cannot be written.
        TrajectoryError: truth and estimate do not overlap in time.
    """
    figure = Figure(figsize=SIZE_INCHES, dpi=DPI, facecolor=palette.PAGE)
    canvas = FigureCanvasAgg(figure)
    colour = colours(records)
    _draw_paths(figure.add_axes((0.03, 0.05, 0.57, 0.86)), {name: lay_out(record) for name, record in records.items()}, colour)
    panels = {name: curves(record) for name, record in records.items()}
    for k, box in enumerate(((0.66, 0.56, 0.31, 0.33), (0.66, 0.1, 0.31, 0.33))):
        _draw_errors(figure.add_axes(box), {name: pair[k] for name, pair in panels.items()}, colour)
    write_via(path, canvas.print_png)


def _draw_paths(axes: Axes, scenes: Mapping[str, Scene], colour: Mapping[str, str]) -> None:
    known = next((scene for scene in scenes.values() if scene.truth is not None), None)
    if known is not None and known.truth is not None:
        axes.add_collection(LineCollection(known.walls.reshape(-1, 2, 2), colors=palette.OCCUPIED, linewidths=1.1, zorder=2))
        axes.plot(*known.truth.poses[:, :2].T, color=palette.TRUTH_PALE, lw=5.0, label="truth", zorder=2)
    for name, scene in scenes.items():
        step = 1 + len(scene.estimate) // MOST_POINTS
        axes.plot(*scene.estimate.poses[::step, :2].T, color=colour[name], lw=1.5, label=name, zorder=3)
    bounds = np.array([scene.bounds for scene in ([known] if known else scenes.values())])
    axes.set(xlim=(bounds[:, 0].min(), bounds[:, 1].max()), ylim=(bounds[:, 2].min(), bounds[:, 3].max()), xticks=[], yticks=[])
    axes.set_aspect("equal")
    axes.spines[:].set_visible(False)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, fontsize=11, frameon=False, labelcolor=palette.INK)


def _draw_errors(axes: Axes, panels: Mapping[str, Curve], colour: Mapping[str, str]) -> None:
    """The last line of every panel is the estimate; the scale is logarithmic, so that one that is lost does not hide the others."""
    unit = "m" if any(curve.unit == "m" for curve in panels.values()) else next(iter(panels.values())).unit
    lowest: list[float] = []
    for name, curve in panels.items():
        if curve.lines:
            line = curve.lines[-1]
            values = 1e-3 * line.values if (unit, curve.unit) == ("m", "mm") else line.values
            step = 1 + len(line.stamps) // MOST_POINTS
            axes.plot(line.stamps[::step], values[::step], color=colour[name], lw=1.3)
            lowest.append(0.1 * float(np.median(values)))
    axes.set_ylim(bottom=max(min(lowest, default=1.0), 1e-6))
    axes.set_title(next(iter(panels.values())).title, loc="left", size=13, weight="bold", color=palette.INK)
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_ylabel(unit, color=palette.MUTED)
    axes.set_xlabel("time [s]", color=palette.MUTED)
    axes.margins(x=0.0)
    axes.tick_params(colors=palette.MUTED, length=0)
    axes.grid(color=palette.UNKNOWN, lw=1.0)
    axes.spines[:].set_visible(False)
