"""What could be seen from where: places to look at a cell from, and the unknown area that a look would show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

BEHIND = 3
"""So far behind a border lies the unknown cell that must be seen [cells]: to look along a border shows nothing."""

SQUARE = 0.5
"""Least cosine of the angle between a look and the way across the border."""
NEARNESS = 1.5
"""What a cell nearer to the border is worth in cells of way: from afar little of what lies behind it is seen."""
CLOSE = 2.0
"""From so near to where the robot is the border has been looked at already [cells]."""


@njit
def viewpoint(lengths: NDArray[np.float64], states: NDArray[np.int8], border: tuple[int, int], reach: float) -> tuple[int, int]:
    """The cell (row, col) near a border, on a short way, that sees what lies behind it; (-1, -1): there is none.

    Args:
        lengths: (H, W) of the ways to all cells [cells]; inf where nobody can go.
        states: (H, W) of 100 occupied, 0 free, -1 unknown.
        border: (row, col) of a free cell beside unknown ones.
        reach: largest distance [cells].
    """
    height, width = lengths.shape
    best, at = np.inf, (-1, -1)
    cell, (down, right) = _behind(states, border)
    bound = int(reach)
    for row in range(max(cell[0] - bound, 0), min(cell[0] + bound + 1, height)):
        for col in range(max(cell[1] - bound, 0), min(cell[1] + bound + 1, width)):
            rows, cols = cell[0] - row, cell[1] - col
            distance = np.sqrt(rows * rows + cols * cols)
            squarely = rows * down + cols * right >= SQUARE * distance
            worth = lengths[row, col] + NEARNESS * distance
            if lengths[row, col] > CLOSE and worth < best and distance <= reach and squarely and sees(states, row, col, cell):
                best, at = worth, (row, col)
    return at


@njit
def _behind(states: NDArray[np.int8], border: tuple[int, int]) -> tuple[tuple[int, int], tuple[float, float]]:
    """The farthest of the unknown cells in a row behind a border cell, and the direction (row, col) of the row, square to the border."""
    height, width = states.shape
    rows, cols = 0.0, 0.0
    for i in range(-BEHIND, BEHIND + 1):
        for k in range(-BEHIND, BEHIND + 1):
            row, col = border[0] + i, border[1] + k
            if 0 <= row < height and 0 <= col < width and states[row, col] < 0:
                rows += i
                cols += k
    length = max(np.sqrt(rows * rows + cols * cols), 1e-9)
    cell = border
    for i in range(1, BEHIND + 1):
        row, col = border[0] + int(np.rint(i * rows / length)), border[1] + int(np.rint(i * cols / length))
        if not (0 <= row < height and 0 <= col < width) or states[row, col] >= 0:
            break
        cell = (row, col)
    return cell, (rows / length, cols / length)


@njit
def sees(states: NDArray[np.int8], row: int, col: int, cell: tuple[int, int]) -> bool:
    """Whether the line from a place to a cell passes beside all that is occupied, and no more unknown cells than lie behind a border.

    A line that grazes a corner shows nothing: its neighbours must be clear too, but at both ends.
    """
    rows, cols = cell[0] - row, cell[1] - col
    count = max(abs(rows), abs(cols))
    beside = (1, 0) if abs(cols) > abs(rows) else (0, 1)
    unknown = 0
    for i in range(1, count):
        r, c = row + int(np.rint(i * rows / count)), col + int(np.rint(i * cols / count))
        unknown += states[r, c] < 0
        if states[r, c] > 0 or unknown > 2 * BEHIND:
            return False
        if 2 < i < count - 2 and (states[r + beside[0], c + beside[1]] > 0 or states[r - beside[0], c - beside[1]] > 0):
            return False
    return True


@njit
def unknown_in_view(states: NDArray[np.int8], viewpoints: NDArray[np.int64], reach: float, depth: float, beams: int) -> NDArray[np.int64]:
    """Number of unknown cells (N,) that a look around from each viewpoint would show.

    Args:
        states: (H, W) of 100 occupied, 0 free, -1 unknown.
        viewpoints: (N, 2) cells (row, col).
        reach: of a look [cells].
        depth: so far into the unknown a beam is believed to go [cells].
        beams: of a look.
    """
    height, width = states.shape
    counted = np.full((height, width), -1, np.int64)
    numbers = np.zeros(len(viewpoints), np.int64)
    for n in range(len(viewpoints)):
        for beam in range(beams):
            angle = 2.0 * np.pi * beam / beams
            along_row, along_col = np.sin(angle), np.cos(angle)
            unknown = 0.0
            for step in range(1, int(reach) + 1):
                row, col = int(np.rint(viewpoints[n, 0] + step * along_row)), int(np.rint(viewpoints[n, 1] + step * along_col))
                if not (0 <= row < height and 0 <= col < width) or states[row, col] > 0:
                    break
                if states[row, col] < 0:
                    unknown += 1.0
                    if counted[row, col] != n:
                        counted[row, col] = n
                        numbers[n] += 1
                    if unknown >= depth:
                        break
    return numbers


@njit
def visible(opaque: NDArray[np.bool_], viewpoints: NDArray[np.int64], reach: float) -> NDArray[np.bool_]:
    """Cells (H, W) within a distance [cells] that are seen from any of the viewpoints (N, 2); beams end at the first opaque cell."""
    height, width = opaque.shape
    seen = np.zeros((height, width), np.bool_)
    beams = int(np.ceil(2.0 * np.pi * reach))
    for n in range(len(viewpoints)):
        for beam in range(beams):
            angle = 2.0 * np.pi * beam / beams
            along_row, along_col = np.sin(angle), np.cos(angle)
            for step in range(int(reach) + 1):
                row, col = int(np.rint(viewpoints[n, 0] + step * along_row)), int(np.rint(viewpoints[n, 1] + step * along_col))
                if not (0 <= row < height and 0 <= col < width):
                    break
                seen[row, col] = True
                if opaque[row, col]:
                    break
    return seen


@njit
def nearest(places: NDArray[np.float64], points: NDArray[np.float64]) -> float:
    """Least distance between two sets of points, (N, 2) and (M, 2); inf where one is empty."""
    least = np.inf
    for i in range(len(places)):
        for k in range(len(points)):
            least = min(least, (places[i, 0] - points[k, 0]) ** 2 + (places[i, 1] - points[k, 1]) ** 2)
    return np.sqrt(least)
