"""`twin print markers`: sheets of markers with their white margins, ids and size."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray
from tyro.conf import arg

from scripts.errors import UsageError
from scripts.options import parse
from scripts.prints.sheets import MARGIN_MM, Paper, Print, Sheet, paper_size_mm, room_mm, write_sheets
from slam.landmarks.markers import MarkerFamily

CAPTION_MM, GAP_MM = 4.0, 3.0
"""Below a marker, and from tile to tile."""
MOST = 2000


@dataclass(frozen=True)
class MarkersOptions:
    """Write markers as a PDF, several on a sheet, each with a white margin, its id, dictionary and size; a scale bar tells whether the
    printer kept the scale.

    $ twin print markers --ids 0-23                    24 markers of 0.12 m on A4
    $ twin print markers --ids 5,7,9 --size 0.05 --paper letter --dictionary DICT_APRILTAG_36h11
    """

    ids: Annotated[str, arg(metavar="A-B,C")] = "0-11"
    """Which."""
    size: Annotated[float, arg(metavar="M")] = MarkerFamily().size
    """Side of the black square [m]."""
    dictionary: Annotated[str, arg(metavar="NAME")] = MarkerFamily().dictionary
    """OpenCV's name, or a file."""
    paper: Paper = "a4"
    out: Annotated[Path, arg(metavar="FILE")] = Path("markers.pdf")
    """PDF to write."""


def main(argv: list[str]) -> int:
    """Write; returns the exit code.

    Raises:
        UsageError, SlamError, OutputError: with one line that says what to do.
    """
    options = parse(MarkersOptions, argv, "print markers")
    family = MarkerFamily(options.dictionary, options.size)
    dictionary = family.load()
    numbers = ids_of(options.ids)
    if max(numbers) >= len(dictionary.bytesList):
        raise UsageError(
            f"--ids {options.ids}: {options.dictionary} has {len(dictionary.bytesList)} ids, 0 to {len(dictionary.bytesList) - 1}"
        )
    modules = dictionary.markerSize + 2
    cells = [np.asarray(cv2.aruco.generateImageMarker(dictionary, number, modules)) == 0 for number in numbers]
    sheets = _laid_out(options, list(zip(numbers, cells, strict=True)), 1e3 * options.size / modules)
    write_sheets(options.out, f"{options.dictionary}, {1e3 * options.size:g} mm", sheets)
    print(f"{options.out}: {len(numbers)} markers of {options.size:g} m on {len(sheets)} sheets of {options.paper}")
    return 0


def ids_of(text: str) -> list[int]:
    """Numbers of `0-3,7`.

    Raises:
        UsageError: it is none.
    """
    numbers: list[int] = []
    for part in text.split(","):
        found = re.fullmatch(r"\s*(\d{1,6})(?:-(\d{1,6}))?\s*", part)
        first, last = (int(found[1]), int(found[2] or found[1])) if found else (1, 0)
        if last < first or len(numbers) + last - first >= MOST:
            raise UsageError(f"--ids {text}: give numbers and ranges as 0-11,20, {MOST} at most")
        numbers += range(first, last + 1)
    return numbers


def _laid_out(options: MarkersOptions, markers: list[tuple[int, NDArray[np.bool_]]], module_mm: float) -> list[Sheet]:
    """As many on a sheet as there is room for, row by row, upright or across, whichever takes more."""
    tile = 1e3 * options.size + 2.0 * module_mm
    counts: dict[bool, tuple[int, int]] = {}
    for landscape in (False, True):
        width, height = room_mm(paper_size_mm(options.paper, landscape))
        counts[landscape] = int((width + GAP_MM) // (tile + GAP_MM)), int((height + GAP_MM) // (tile + CAPTION_MM + GAP_MM))
    landscape = counts[True][0] * counts[True][1] > counts[False][0] * counts[False][1]
    across, down = counts[landscape]
    if across * down == 0:
        width, height = room_mm(paper_size_mm(options.paper, False))
        most = min(width, height - CAPTION_MM) / (tile / (1e3 * options.size)) / 1e3
        raise UsageError(f"--size {options.size:g}: with its margin it does not fit on {options.paper}; at most {most:.3f} m")
    size = paper_size_mm(options.paper, landscape)
    sheets: list[Sheet] = []
    for first in range(0, len(markers), across * down):
        prints = [
            Print(
                cells,
                module_mm,
                MARGIN_MM + module_mm + (k % across) * (tile + GAP_MM),
                size[1] - MARGIN_MM - module_mm - (k // across) * (tile + CAPTION_MM + GAP_MM),
                f"id {number}   {options.dictionary}   {1e3 * options.size:g} mm",
                module_mm,
            )
            for k, (number, cells) in enumerate(markers[first : first + across * down])
        ]
        sheets.append(Sheet(size, prints))
    return sheets
