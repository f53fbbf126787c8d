"""`coverage.png`: where in the picture the views have shown corners, and what is left of their errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from scripts.runs import palette
from scripts.runs.files import write_via
from slam.landmarks.boards import BoardView
from slam.landmarks.camera_calibration import Calibration
from slam.se2 import FloatArray

GRID = 16, 9
"""Fields of the picture, across and down."""
SHADES = LinearSegmentedColormap.from_list("coverage", ["#ffffff", "#9cc4ff", "#1d5fd1"])
ARROWS = 20.0
"""Errors are drawn so many times larger."""


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """What was chosen of the pictures."""

    chosen: tuple[BoardView, ...]
    names: tuple[str, ...]
    looked: int
    """Pictures looked at."""
    size: tuple[int, int]
    """Width, height [px]."""

    def counts(self, used: Sequence[int]) -> FloatArray:
        """Corners in each field (down, across) of the picture."""
        pixels = np.concatenate([self.chosen[k].pixels for k in used])
        counts, _, _ = np.histogram2d(pixels[:, 1], pixels[:, 0], bins=GRID[::-1], range=((0, self.size[1]), (0, self.size[0])))
        return counts

    def coverage(self, used: Sequence[int]) -> float:
        """Share of the fields that have a corner."""
        return float(np.mean(self.counts(used) > 0))


def write_coverage_png(path: Path, title: str, found: Calibration, views: Views) -> None:
    """Draw fields, corners and errors.

    Raises:
        OutputError: the file cannot be written.
    """
    figure = Figure(figsize=(15.0, 6.4), dpi=110, facecolor=palette.PAGE, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    figure.suptitle(title, x=0.02, ha="left", size=14, weight="bold", color=palette.INK)
    left, right = figure.subplots(1, 2, width_ratios=(1.7, 1.0))
    _draw_coverage(left, found, views)
    _draw_errors(right, found)
    write_via(path, canvas.print_png)


def _draw_coverage(axes: Axes, found: Calibration, views: Views) -> None:
    width, height = views.size
    axes.imshow(views.counts(found.used), cmap=SHADES, extent=(0, width, height, 0), vmin=0, interpolation="nearest", alpha=0.8)
    for k, residuals in zip(found.used, found.residuals, strict=True):
        pixels = views.chosen[k].pixels
        axes.plot(*pixels.T, ".", ms=3.0, color=palette.INK)
        axes.quiver(*pixels.T, *residuals.T, angles="xy", scale_units="xy", scale=1.0 / ARROWS, width=0.0012, color=palette.SCAN)
    axes.plot(found.camera.K[0, 2], found.camera.K[1, 2], "+", ms=16, mew=2.5, color=palette.ESTIMATE, label="principal point")
    axes.set(xlim=(0, width), ylim=(height, 0), xlabel="column [px]", ylabel="row [px]")
    covered = 100.0 * views.coverage(found.used)
    axes.set_title(f"{len(found.used)} views cover {covered:.0f} % of the picture; errors {ARROWS:g} times larger", loc="left", size=11)
    axes.legend(loc="lower right", frameon=True)


def _draw_errors(axes: Axes, found: Calibration) -> None:
    for residuals in found.residuals:
        axes.plot(*residuals.T, ".", ms=4.0, alpha=0.7)
    reach = 1.1 * max(float(np.abs(np.concatenate(found.residuals)).max()), 0.1)
    axes.set(xlim=(-reach, reach), ylim=(reach, -reach), aspect="equal", xlabel="seen less projected, across [px]", ylabel="down [px]")
    axes.set_title(f"RMS {found.rms:.3f} px; one colour a view", loc="left", size=11)
    axes.grid(color=palette.UNKNOWN)
