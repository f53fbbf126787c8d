"""`report.png`: the map with all trajectories, the errors over time and the figures that matter, on one 16:9 page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.transforms import Affine2D

from scripts.runs import palette
from scripts.runs.curves import Curve, curves
from scripts.runs.ellipses import draw_crosses
from scripts.runs.files import write_via
from scripts.runs.headlines import headlines
from scripts.runs.record import RunRecord
from scripts.runs.scene import Scene, lay_out
from slam.grid import OccupancyGrid
from slam.messages import Trajectory
from slam.se2 import SE2

SIZE_INCHES, DPI = (16.0, 9.0), 120
MAP_BOX = (0.03, 0.075, 0.57, 0.805)
"""Left, bottom, width, height of the map panel, in figure fractions."""
SCALE_BARS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
MOST_POINTS = 4000
"""A line of more points is thinned before it is drawn."""


def write_report_png(path: Path, run: RunRecord) -> None:
    """Write the report picture of a run, 1920 x 1080.

    Raises:
        OutputError: the file cannot be written.
        TrajectoryError: truth and estimate do not overlap in time.
    """
    figure = Figure(figsize=SIZE_INCHES, dpi=DPI, facecolor=palette.PAGE)
    canvas = FigureCanvasAgg(figure)
    figure.text(0.03, 0.945, run.title, size=20, weight="bold", color=palette.INK, va="center")
    scene = lay_out(run)
    _draw_map(figure.add_axes(MAP_BOX), run, scene)
    position, heading = curves(run)
    draw_curve(figure.add_axes((0.66, 0.68, 0.31, 0.19)), position)
    lower = figure.add_axes((0.66, 0.395, 0.31, 0.19))
    draw_curve(lower, heading)
    lower.set_xlabel("time [s]", color=palette.MUTED)
    _draw_headlines(figure, headlines(run.metrics))
    write_via(path, canvas.print_png)


def _draw_map(axes: Axes, run: RunRecord, scene: Scene) -> None:
    axes.set_facecolor(palette.UNKNOWN)
    draw_cells(axes, run.map, scene.T_world_map)
    axes.add_collection(LineCollection(scene.walls.reshape(-1, 2, 2), colors=palette.TRUTH, linewidths=1.1, zorder=2))
    if scene.truth is not None:
        draw_path(axes, scene.truth, palette.TRUTH_PALE, 5.0, "truth")
    draw_path(axes, scene.odometry, palette.ODOMETRY, 1.6, "odometry")
    draw_path(axes, scene.estimate, palette.ESTIMATE, 1.8, "estimate")
    draw_crosses(axes, run.key_frames, scene.T_world_map)
    _draw_ends(axes, scene.estimate)
    x_limits, y_limits = fill_panel(scene.bounds)
    axes.set(xlim=x_limits, ylim=y_limits, xticks=[], yticks=[], aspect="auto")
    axes.spines[:].set_visible(False)
    axes.legend(loc="lower right", bbox_to_anchor=(1.01, 0.995), ncols=5, fontsize=11, frameon=False, labelcolor=palette.INK)
    _draw_scale_bar(axes, x_limits)


def fill_panel(bounds: tuple[float, float, float, float]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Limits in x and y that hold the bounds, fill the map's panel and keep both axes at one scale."""
    x_min, x_max, y_min, y_max = bounds
    aspect = (MAP_BOX[2] * SIZE_INCHES[0]) / (MAP_BOX[3] * SIZE_INCHES[1])
    height = max(y_max - y_min, (x_max - x_min) / aspect)
    x, y = 0.5 * (x_min + x_max), 0.5 * (y_min + y_max)
    return (x - 0.5 * height * aspect, x + 0.5 * height * aspect), (y - 0.5 * height, y + 0.5 * height)


def draw_cells(axes: Axes, grid: OccupancyGrid, T_world_map: SE2) -> None:
    """Draw the cells of a map that are known."""
    known = np.argwhere(grid.states() >= 0)
    if len(known) == 0:
        return
    (row, col), (last_row, last_col) = known.min(axis=0), known.max(axis=0) + 1
    colours = np.array([to_rgba(palette.FREE), to_rgba(palette.OCCUPIED), (0.0, 0.0, 0.0, 0.0)])
    states = grid.states()[row:last_row, col:last_col]
    pixels = colours[np.select([states == 0, states == 100], [0, 1], 2)]
    T = T_world_map @ grid.geometry.T_map_grid
    resolution = grid.geometry.resolution
    axes.imshow(
        pixels,
        origin="lower",
        interpolation="nearest",
        extent=(col * resolution, last_col * resolution, row * resolution, last_row * resolution),
        transform=Affine2D().rotate(T.yaw).translate(T.x, T.y) + axes.transData,
        zorder=1,
    )


def draw_path(axes: Axes, path: Trajectory, colour: str, width: float, label: str) -> None:
    """Draw a trajectory as a line."""
    x, y = path.poses[:: 1 + len(path) // MOST_POINTS, :2].T
    axes.plot(x, y, color=colour, lw=width, label=label, solid_capstyle="round", solid_joinstyle="round", zorder=3)


def _draw_ends(axes: Axes, path: Trajectory) -> None:
    if len(path) == 0:
        return
    for pose, face, label in ((path.poses[0], palette.PAGE, "start"), (path.poses[-1], palette.ESTIMATE, "end")):
        axes.plot(*pose[:2], "o", ms=11, mfc=face, mec=palette.ESTIMATE, mew=2.2, label=label, ls="none", zorder=5)


def _draw_scale_bar(axes: Axes, x_limits: tuple[float, float]) -> None:
    x, x_end = x_limits
    length = max((bar for bar in SCALE_BARS if bar <= 0.25 * (x_end - x)), default=SCALE_BARS[0])
    below = axes.get_xaxis_transform()
    axes.plot([x, x + length], [-0.028, -0.028], color=palette.INK, lw=3, solid_capstyle="butt", clip_on=False, transform=below)
    axes.text(x + length + 0.01 * (x_end - x), -0.028, f"{length:g} m", va="center", color=palette.INK, size=11, transform=below)


def draw_curve(axes: Axes, curve: Curve) -> None:
    """Draw one panel of lines over time, from 0 upwards."""
    for line in curve.lines:
        step = 1 + len(line.stamps) // MOST_POINTS
        axes.plot(line.stamps[::step], line.values[::step], color=line.colour, lw=1.5, label=line.label)
    axes.set_title(curve.title, loc="left", size=13, weight="bold", color=palette.INK, pad=24)
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.0)
    axes.set_ylabel(curve.unit, color=palette.MUTED)
    axes.tick_params(colors=palette.MUTED, length=0)
    axes.grid(color=palette.UNKNOWN, lw=1.0)
    axes.spines[:].set_visible(False)
    if curve.lines:
        axes.legend(
            loc="lower left", bbox_to_anchor=(-0.01, 0.99), ncols=2, fontsize=10.5, frameon=False, labelcolor=palette.INK, borderpad=0.2
        )


def _draw_headlines(figure: Figure, entries: list[tuple[str, str]]) -> None:
    for index, (label, value) in enumerate(entries):
        x, y = 0.66 + 0.109 * (index % 3), 0.24 - 0.082 * (index // 3)
        figure.text(x, y, value, size=19, weight="bold", color=palette.INK)
        figure.text(x, y - 0.026, label, size=10.5, color=palette.MUTED)
