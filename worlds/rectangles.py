"""Cells as few rectangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Rectangle = tuple[int, int, int, int]
"""First row and column, and the ones after the last."""


def rectangles(mask: NDArray[np.bool_]) -> list[Rectangle]:
    """Rectangles that cover exactly the cells of a mask and do not overlap: each first as long, then as broad as it can get."""
    left = mask.copy()
    found: list[Rectangle] = []
    for row, col in np.argwhere(mask).tolist():
        if not left[row, col]:
            continue
        right, down = _run(left[row, col:]), _run(left[row:, col])
        if right >= down:
            box = (row, col, row + _run(left[row:, col : col + right].all(axis=1)), col + right)
        else:
            box = (row, col, row + down, col + _run(left[row : row + down, col:].all(axis=0)))
        left[box[0] : box[2], box[1] : box[3]] = False
        found.append(box)
    return found


def _run(cells: NDArray[np.bool_] | np.bool_) -> int:
    """How many cells are set before the first that is not."""
    return cells.size if cells.all() else int(np.argmin(cells))
