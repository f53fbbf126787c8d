"""Sheets of paper in a PDF, drawn in millimetres: true to scale where the printer does not scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import FigureCanvasPdf, PdfPages
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from numpy.typing import NDArray

from scripts.runs.files import write_via

Paper = Literal["a4", "letter"]
SIZES_MM: dict[str, tuple[float, float]] = {"a4": (210.0, 297.0), "letter": (215.9, 279.4)}
"""Paper -> width, height, upright."""
MARGIN_MM, FOOT_MM = 10.0, 14.0
"""What printers leave white at each edge, and the scale bar's room at the lower one."""
INCH_MM = 25.4
BAR_MM = 100.0
GREY = "#9a9a9a"


@dataclass(frozen=True, slots=True, eq=False)
class Print:
    """Something black on white."""

    cells: NDArray[np.bool_]
    """(H, W) true where it is black, the top row first."""
    cell_mm: float
    left_mm: float
    """From the sheet's left edge."""
    top_mm: float
    """From the sheet's lower edge to its upper edge."""
    caption: str
    """Below it."""
    quiet_mm: float
    """White round it; a cut line follows."""


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """A page."""

    size_mm: tuple[float, float]
    prints: Sequence[Print]


def paper_size_mm(paper: Paper, landscape: bool) -> tuple[float, float]:
    """Width and height."""
    width, height = SIZES_MM[paper]
    return (height, width) if landscape else (width, height)


def room_mm(size_mm: tuple[float, float]) -> tuple[float, float]:
    """Width and height that can be printed on, above the scale bar."""
    return size_mm[0] - 2.0 * MARGIN_MM, size_mm[1] - 2.0 * MARGIN_MM - FOOT_MM


def write_sheets(path: Path, title: str, sheets: Sequence[Sheet]) -> None:
    """Write a PDF: a whole file or none; the same sheets give the same bytes.

    Raises:
        OutputError: it cannot be written.
    """

    def write(partial: Path) -> None:
        with PdfPages(partial, metadata={"Title": title, "CreationDate": None}) as pages:
            for number, sheet in enumerate(sheets, start=1):
                pages.savefig(_page(sheet, f"{title}, sheet {number} of {len(sheets)}"))

    write_via(path, write)


def _page(sheet: Sheet, title: str) -> Figure:
    width, height = sheet.size_mm
    figure = Figure(figsize=(width / INCH_MM, height / INCH_MM))
    FigureCanvasPdf(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, width), ylim=(0.0, height))
    axes.axis("off")
    for one in sheet.prints:
        _draw(axes, one)
    _draw_scale_bar(axes, title)
    return figure


def _draw(axes: Axes, one: Print) -> None:
    rows, columns = one.cells.shape
    width, height, quiet = columns * one.cell_mm, rows * one.cell_mm, one.quiet_mm
    axes.add_patch(PathPatch(outline(one), facecolor="black", linewidth=0.0))
    left, right, low, high = one.left_mm - quiet, one.left_mm + width + quiet, one.top_mm - height - quiet, one.top_mm + quiet
    axes.plot([left, right, right, left, left], [low, low, high, high, low], color=GREY, lw=0.3, ls=(0, (6, 4)))
    axes.text(left, low - 1.0, one.caption, size=7.0, va="top", color="#333333")


def outline(one: Print) -> Outline:
    """The black cells as one path of rectangles, a run of cells each: one path leaves no hairlines between its parts."""
    corners: list[tuple[float, float]] = []
    for row, line in enumerate(one.cells.tolist()):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], line, [False]]).astype(np.int8))).reshape(-1, 2)
        for start, stop in (one.left_mm + edges * one.cell_mm).tolist():
            high, low = one.top_mm - row * one.cell_mm, one.top_mm - (row + 1) * one.cell_mm
            corners += [(start, low), (stop, low), (stop, high), (start, high), (start, low)]
    codes = [Outline.MOVETO, Outline.LINETO, Outline.LINETO, Outline.LINETO, Outline.CLOSEPOLY] * (len(corners) // 5)
    return Outline(corners, codes)


def _draw_scale_bar(axes: Axes, title: str) -> None:
    x, y = MARGIN_MM, MARGIN_MM
    marks = PathPatch(
        Outline(
            [(x, y), (x + BAR_MM, y), (x + BAR_MM, y + 1.0), (x, y + 1.0), (x, y)],
            [Outline.MOVETO, Outline.LINETO, Outline.LINETO, Outline.LINETO, Outline.CLOSEPOLY],
        ),
        facecolor="black",
        linewidth=0.0,
    )
    axes.add_patch(marks)
    for mark in np.arange(0.0, BAR_MM + 1.0, 10.0).tolist():
        axes.plot([x + mark, x + mark], [y, y + 3.0], color="black", lw=0.5, solid_capstyle="butt")
    axes.text(x, y + 3.6, f"{BAR_MM:g} mm: measure it. Print at 100 %, not fitted to the page.", size=7.0, va="bottom")
    axes.text(x + BAR_MM + 5.0, y, title, size=7.0, va="bottom")
