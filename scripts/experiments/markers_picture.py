"""The picture of `twin experiment markers`: errors over the spacing, and maps from above."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scripts.bench.marker_scenes import map_alignment
from scripts.runs import palette
from scripts.runs.files import write_via

if TYPE_CHECKING:
    from scripts.experiments.markers import Mapped

COLOURS = {"chain": palette.ODOMETRY, "graph": palette.ESTIMATE}
DASHES = {"spin": "--", "perimeter": "-"}
MM = 1e3


def write_markers_png(path: Path, maps: Sequence[Mapped]) -> None:
    """Draw all maps' errors, and the maps of the spacing in the middle from above.

    Raises:
        OutputError: the file cannot be written.
    """
    spacings = sorted({found.spacing for found in maps})
    shown = [found for found in maps if found.spacing == spacings[len(spacings) // 2]]
    policies = list(dict.fromkeys(found.policy for found in shown))
    figure = Figure(figsize=(16.0, 6.0), dpi=110, facecolor=palette.PAGE, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    axes = figure.subplots(1, 1 + len(policies), width_ratios=(1.25, *(1.0 for _ in policies)))
    _draw_errors(axes[0], maps)
    for place, policy in zip(axes[1:], policies, strict=True):
        _draw_maps(place, [found for found in shown if found.policy == policy])
    write_via(path, canvas.print_png)


def _draw_errors(axes: Axes, maps: Sequence[Mapped]) -> None:
    for method, colour in COLOURS.items():
        for policy, dashes in DASHES.items():
            some = [found for found in maps if (found.method, found.policy) == (method, policy)]
            x, y = [found.spacing for found in some], [MM * found.rms for found in some]
            axes.plot(x, y, dashes, marker="o", color=colour, label=f"{method}, {policy}")
            for found in some:
                share = f"{len(found.found.markers)}/{len(found.truth.markers)}"
                offset = (4, 6) if policy == "perimeter" else (4, -12)
                axes.annotate(share, (found.spacing, MM * found.rms), offset, textcoords="offset points", fontsize=8, color=colour)
    axes.set(xscale="log", yscale="log", xlabel="from marker to marker [m]", ylabel="markers' places, RMS [mm]")
    spacings = sorted({found.spacing for found in maps})
    axes.set_xticks(spacings, [f"{spacing:g}" for spacing in spacings])
    axes.minorticks_off()
    axes.set_title("error of the marker maps; how many markers they hold", loc="left", size=12, color=palette.INK)
    axes.grid(color=palette.UNKNOWN)
    axes.legend(frameon=False)


def _draw_maps(axes: Axes, maps: Sequence[Mapped]) -> None:
    first = maps[0]
    axes.plot(*first.way[:, :2].T, color=palette.TRUTH_PALE, lw=2.0, label="the robot's way")
    places = np.array([marker.T_map_marker.t for marker in first.truth.markers.values()])
    axes.plot(*places[:, :2].T, "s", ms=9, mfc="none", color=palette.TRUTH, label="true markers")
    for found in maps:
        T_true_found = map_alignment(found.found, found.truth)
        points = np.array([T_true_found.transform(marker.T_map_marker.t) for marker in found.found.markers.values()]).reshape(-1, 3)
        axes.plot(*points[:, :2].T, "x" if found.method == "chain" else ".", ms=7, color=COLOURS[found.method], label=found.method)
    axes.set(aspect="equal", xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    axes.set_title(f"{first.policy}, markers every {first.spacing:g} m, from above", loc="left", size=12, color=palette.INK)
    axes.legend(loc="center", frameon=True, fontsize=9)
