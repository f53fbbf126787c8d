"""`twin print board`: a board to calibrate a camera by."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from scripts.errors import UsageError
from scripts.options import parse
from scripts.prints.sheets import MARGIN_MM, Paper, Print, Sheet, paper_size_mm, room_mm, write_sheets
from slam.landmarks.boards import Board

CAPTION_MM = 4.0


@dataclass(frozen=True)
class BoardOptions:
    """Write a board as a PDF on one sheet, with a scale bar. Glue it on something flat; `twin calibrate camera` takes the same options."""

    kind: Literal["charuco", "chessboard"] = "charuco"
    """A ChArUco board may be seen in part, a chessboard must be seen whole."""
    squares: Annotated[tuple[int, int], arg(metavar="ACROSS DOWN")] = (Board().columns, Board().rows)
    """Squares of the board."""
    square: Annotated[float, arg(metavar="M")] = Board().square
    """Side of a square [m]."""
    marker: Annotated[float, arg(metavar="M")] = Board().marker
    """Side of a marker's black square [m]."""
    dictionary: Annotated[str, arg(metavar="NAME")] = Board().dictionary
    """Of the markers: OpenCV's name, or a file."""
    first: Annotated[int, arg(metavar="ID")] = 0
    """Id of the first marker."""
    paper: Paper = "a4"
    out: Annotated[Path, arg(metavar="FILE")] = Path("board.pdf")
    """PDF to write."""


def main(argv: list[str]) -> int:
    """Write; returns the exit code.

    Raises:
        UsageError, SlamError, OutputError: with one line that says what to do.
    """
    options = parse(BoardOptions, argv, "print board")
    board = Board(options.kind, *options.squares, options.square, options.marker, options.dictionary, options.first)
    cells, cell = board.cells()
    width, height = (1e3 * cell * count for count in cells.shape[::-1])
    size = _sheet_for(options.paper, width, height)
    left, top = 0.5 * (size[0] - width), size[1] - MARGIN_MM - 0.5 * (room_mm(size)[1] - CAPTION_MM - height)
    caption = f"{board}, first id {board.first}" if board.kind == "charuco" else str(board)
    write_sheets(
        options.out,
        f"{board.kind}, squares of {1e3 * board.square:g} mm",
        [Sheet(size, [Print(cells, 1e3 * cell, left, top, caption, 0.0)])],
    )
    print(f"{options.out}: {board} on {options.paper}")
    return 0


def _sheet_for(paper: Paper, width: float, height: float) -> tuple[float, float]:
    """The sheet, upright if that is enough.

    Raises:
        UsageError: neither way is enough.
    """
    for landscape in (False, True):
        room = room_mm(size := paper_size_mm(paper, landscape))
        if width <= room[0] and height <= room[1] - CAPTION_MM:
            return size
    room = room_mm(paper_size_mm(paper, False))
    fits = f"{room[0]:.0f} x {room[1] - CAPTION_MM:.0f} mm"
    raise UsageError(f"the board is {width:.0f} x {height:.0f} mm; {paper} has room for {fits}: take smaller or fewer squares")
