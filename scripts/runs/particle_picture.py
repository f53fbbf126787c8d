"""`particles.png`: where a particle filter took the robot to be, from time to time, and how its belief went."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scripts.runs import palette
from scripts.runs.curves import belief_curves, curves
from scripts.runs.files import write_via
from scripts.runs.pictures import DPI, MAP_BOX, SIZE_INCHES, draw_cells, draw_curve, draw_path, fill_panel
from scripts.runs.record import RunRecord
from scripts.runs.scene import Scene, lay_out

MOMENTS = 12
"""Clouds that are drawn."""
PANELS = (0.80, 0.565, 0.33, 0.095)
"""Lower edges of the panels, in figure fractions."""


def write_particles_png(path: Path, run: RunRecord) -> None:
    """Write the picture of a run whose pipeline has particles, 1920 x 1080: the source report's views of its filter.

    Raises:
        OutputError: the file cannot be written.
        TrajectoryError: truth and estimate do not overlap in time.
    """
    figure = Figure(figsize=SIZE_INCHES, dpi=DPI, facecolor=palette.PAGE)
    canvas = FigureCanvasAgg(figure)
    figure.text(0.03, 0.945, f"{run.title}: particles", size=20, weight="bold", color=palette.INK, va="center")
    _draw_clouds(figure.add_axes(MAP_BOX), run, lay_out(run))
    panels = (curves(run)[0], *belief_curves(run))
    for bottom, curve in zip(PANELS, panels, strict=True):
        axes = figure.add_axes((0.66, bottom, 0.31, 0.125))
        draw_curve(axes, curve)
    axes.set_xlabel("time [s]", color=palette.MUTED)
    write_via(path, canvas.print_png)


def _draw_clouds(axes: Axes, run: RunRecord, scene: Scene) -> None:
    axes.set_facecolor(palette.UNKNOWN)
    draw_cells(axes, run.map, scene.T_world_map)
    if scene.truth is not None:
        draw_path(axes, scene.truth, palette.TRUTH_PALE, 5.0, "truth")
    draw_path(axes, scene.estimate, palette.ESTIMATE, 1.2, "estimate")
    moments = [frame for frame in run.key_frames if len(frame.particles)]
    for index in np.unique(np.linspace(0, len(moments) - 1, min(MOMENTS, len(moments))).round().astype(int)):
        x, y = scene.T_world_map.transform(moments[index].particles[:, :2]).T
        label = "particles, from time to time" if index == 0 else None
        axes.plot(x, y, ".", ms=2.0, color=palette.PARTICLES, alpha=0.6, label=label, ls="none", zorder=4)
    x_limits, y_limits = fill_panel(scene.bounds)
    axes.set(xlim=x_limits, ylim=y_limits, xticks=[], yticks=[], aspect="auto")
    axes.spines[:].set_visible(False)
    axes.legend(loc="lower right", bbox_to_anchor=(1.01, 0.995), ncols=3, fontsize=11, frameon=False, labelcolor=palette.INK)
