"""Flat boards with known corners, by which a camera is calibrated: ChArUco boards and chessboards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from slam.errors import ParameterError, require_not_negative, require_positive
from slam.landmarks.markers import MarkerFamily
from slam.se2 import FloatArray

Image = NDArray[np.uint8]
FoundMarkers = tuple[Sequence[Any], Any]
"""Corners and ids as OpenCV gives them."""
NO_MARKERS: FoundMarkers = ((), None)
FEWEST = 8
"""Corners that a view must show; a homography takes four."""
WINDOWS = (3, 8)
"""Smallest and largest half of a window in which a corner is refined [px]."""
FINEST = 64
"""Most cells along a square's side, when a board is drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class BoardView:
    """The corners of a board that an image shows."""

    numbers: NDArray[np.int64]
    """(K,) places among `Board.corners`."""
    pixels: FloatArray
    """(K, 2) [px]"""


@dataclass(frozen=True, slots=True)
class Board:
    """A printed board. Its frame: origin at the print's top left corner, x to the right, y down, z into the print."""

    kind: Literal["charuco", "chessboard"] = "charuco"
    """`charuco` has markers in its white squares and may be seen in part; a `chessboard` must be seen whole."""
    columns: int = 5
    """Squares across."""
    rows: int = 7
    """Squares down."""
    square: float = 0.036
    """Side of a square [m]."""
    marker: float = 0.027
    """Side of a marker's black square [m]."""
    dictionary: str = "DICT_6X6_250"
    """Of the markers: OpenCV's name, or a file."""
    first: int = 0
    """Id of the first marker, top left; the others follow row by row."""

    def __post_init__(self) -> None:
        require_positive(self, "square", "marker")
        require_not_negative(self, "first")
        for name in ("columns", "rows"):
            if not 3 <= getattr(self, name) <= 100:
                raise ParameterError(self, name, "3 to 100 squares")
        if self.kind == "charuco" and not self.marker < self.square:
            raise ParameterError(self, "marker", f"smaller than a square, {self.square:g} m")

    def __str__(self) -> str:
        markers = f", markers of {self.marker:g} m of {self.dictionary}" if self.kind == "charuco" else ""
        return f"{self.kind} of {self.columns} x {self.rows} squares of {self.square:g} m{markers}"

    @property
    def corners(self) -> FloatArray:
        """(N, 3) inner corners, where four squares meet, row by row [m]."""
        x, y = np.meshgrid(np.arange(1.0, self.columns), np.arange(1.0, self.rows))
        return self.square * np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])

    def layout(self) -> cv2.aruco.CharucoBoard:
        """OpenCV's board.

        Raises:
            ParameterError: no such dictionary, or it has too few ids.
        """
        dictionary, count = MarkerFamily(self.dictionary).load(), (self.columns * self.rows) // 2
        if self.first + count > len(dictionary.bytesList):
            raise ParameterError(self, "first", f"{len(dictionary.bytesList) - count} at most: {self.dictionary} has so many ids")
        ids = np.arange(self.first, self.first + count, dtype=np.int32)
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square, self.marker, dictionary, ids)

    def cells(self) -> tuple[NDArray[np.bool_], float]:
        """The print as cells, true where it is black, row by row from the top, and a cell's side [m].

        Raises:
            ParameterError: squares and markers have no common measure; no such dictionary.
        """
        across = np.add.outer(np.arange(self.rows), np.arange(self.columns))
        if self.kind == "chessboard":
            return across % 2 == 0, self.square
        layout = self.layout()
        dictionary = layout.getDictionary()
        modules = dictionary.markerSize + 2
        count, fine = self._measures(modules)
        cells = (across % 2 == 0).repeat(count, axis=0).repeat(count, axis=1)
        for number, corners in enumerate(layout.getObjPoints(), start=self.first):
            drawn = np.asarray(cv2.aruco.generateImageMarker(dictionary, number, modules * fine)) == 0
            column, row = np.rint(np.asarray(corners, np.float64)[0, :2] / self.square * count).astype(int).tolist()
            cells[row : row + len(drawn), column : column + len(drawn)] = drawn
        return cells, self.square / count

    def _measures(self, modules: int) -> tuple[int, int]:
        """Cells along a square and along a marker's module."""
        for count in range(1, FINEST + 1):
            fine = self.marker / self.square * count / modules
            rest = count - round(fine) * modules
            if round(fine) > 0 and abs(fine - round(fine)) < 1e-6 and rest % 2 == 0:
                return count, round(fine)
        ratios = ", ".join(f"{self.square * modules / (modules + 2 * margin):.4g}" for margin in (1, 2, 4))
        raise ParameterError(self, "marker", f"a simple part of the square {self.square:g} m to be drawn, such as {ratios}")


def refined(grey: Image, pixels: FloatArray, room: float) -> FloatArray:
    """Corners (K, 2) [px] where four squares meet, by the gradients within `room` [px] of where they are thought to be.

    OpenCV's own finder stops at steps of 0.1 px.
    """
    half = int(np.clip(room, *WINDOWS))
    stop = cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4
    found = cv2.cornerSubPix(grey, pixels.astype(np.float32).reshape(-1, 1, 2), (half, half), (-1, -1), stop)
    return np.asarray(found, np.float64).reshape(-1, 2)


def _grey(image: Image) -> Image:
    return np.ascontiguousarray(image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


class BoardFinder:
    """Finds a board's corners; keeps nothing from image to image."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self._charuco = cv2.aruco.CharucoDetector(board.layout()) if board.kind == "charuco" else None
        self._markers = cv2.aruco.ArucoDetector(board.layout().getDictionary()) if board.kind == "charuco" else None

    def find(self, image: Image, markers: FoundMarkers = NO_MARKERS) -> BoardView | None:
        """The view of the board in an image (H, W) grey or (H, W, 3) red, green, blue; None where it does not show enough of it.

        Args:
            image: to look at.
            markers: what `markers` has found in it; otherwise they are looked for.
        """
        grey = _grey(image)
        return self._chessboard(grey) if self._charuco is None else self._squares(self._charuco, grey, markers)

    def markers(self, image: Image) -> FoundMarkers:
        """Corners and ids of the dictionary's markers in an image, for `find` of all boards that have it."""
        if self._markers is None:
            return NO_MARKERS
        corners, ids, _ = cast("tuple[Any, Any, Any]", self._markers.detectMarkers(_grey(image)))
        return NO_MARKERS if ids is None else (corners, ids)

    def mirrored(self, image: Image) -> bool:
        """Whether the image shows the board only when it is mirrored; a chessboard looks like one either way."""
        return self._charuco is not None and self.find(image) is None and self.find(np.ascontiguousarray(image[:, ::-1])) is not None

    def _squares(self, detector: cv2.aruco.CharucoDetector, grey: Image, found: FoundMarkers) -> BoardView | None:
        pixels, numbers, _, markers = cast("tuple[Any, Any, Any, Any]", detector.detectBoard(grey, None, None, *found))
        if numbers is None:
            return None
        twice = len(np.unique(np.asarray(markers))) < np.size(markers)
        if np.size(numbers) < FEWEST or twice:
            return None
        places, rough = np.asarray(numbers, np.int64).ravel(), np.asarray(pixels, np.float64).reshape(-1, 2)
        return BoardView(places, refined(grey, rough, self._room(places, rough)))

    def _room(self, places: NDArray[np.int64], pixels: FloatArray) -> float:
        """Pixels from a corner to the nearest marker, in the part of the view where the board is smallest."""
        corners = self.board.corners[places, :2]
        off, apart = pixels[:, None] - pixels, np.hypot(*np.moveaxis(corners[:, None] - corners, 2, 0))
        sides = np.hypot(off[..., 0], off[..., 1])[np.isclose(apart, self.board.square)]
        margin = 0.5 * (1.0 - self.board.marker / self.board.square)
        return margin * float(sides.min(initial=np.inf)) if len(sides) else 0.0

    def _chessboard(self, grey: Image) -> BoardView | None:
        inner = self.board.columns - 1, self.board.rows - 1
        found, pixels = cv2.findChessboardCornersSB(grey, inner, None, cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE)
        return BoardView(np.arange(inner[0] * inner[1]), np.asarray(pixels, np.float64).reshape(-1, 2)) if found else None
