"""The error table of perfect match: distances to wall segments and to points, cell by cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Table = NDArray[np.float32]


@njit
def draw_segments(table: Table, segments: Floats, cell: float, reach: float) -> None:
    """Lower the distances at the cells' corners to those of segments (S, 4) in the table's frame, whose free side is on the left.

    The distance is negative on the right of a segment: where a wall crosses a cell the interpolant then passes through zero at the wall.
    Without the sign its lowest point would lie at one of the cell's corners, up to half a cell off.
    """
    for s in range(len(segments)):
        x0, y0, x1, y1 = segments[s]
        length = np.hypot(x1 - x0, y1 - y0)
        ux, uy = (x1 - x0) / length, (y1 - y0) / length
        rows, cols = _window(table, min(y0, y1), max(y0, y1), cell, reach), _window(table.T, min(x0, x1), max(x0, x1), cell, reach)
        for row in range(rows[0], rows[1]):
            for col in range(cols[0], cols[1]):
                dx, dy = col * cell - x0, row * cell - y0
                along, across = ux * dx + uy * dy, ux * dy - uy * dx
                beyond = max(-along, along - length, 0.0)
                distance = np.sqrt(across * across + beyond * beyond)
                if distance < abs(table[row, col]):
                    table[row, col] = distance if across >= 0.0 else -distance


@njit
def draw_points(table: Table, points: Floats, cell: float, reach: float) -> None:
    """Lower the distances at the cells' corners to those of points (P, 2) in the table's frame."""
    for p in range(len(points)):
        x, y = points[p]
        rows, cols = _window(table, y, y, cell, reach), _window(table.T, x, x, cell, reach)
        for row in range(rows[0], rows[1]):
            for col in range(cols[0], cols[1]):
                distance = np.hypot(col * cell - x, row * cell - y)
                if distance < abs(table[row, col]):
                    table[row, col] = distance


@njit
def _window(table: Table, low: float, high: float, cell: float, reach: float) -> tuple[int, int]:
    """The rows within reach of an interval, clipped to the table."""
    return max(int(np.ceil((low - reach) / cell)), 0), min(int((high + reach) / cell) + 1, table.shape[0])


@njit
def patches(table: Table, cell: float) -> Table:
    """Coefficients (H - 1, W - 1, 4) of the bilinear interpolant of each cell, d = p0 + p1 a + p2 b + p3 a b with a, b in 0..1.

    Away from walls the sign is dropped: where two walls are equally far it would jump.
    """
    found = np.empty((table.shape[0] - 1, table.shape[1] - 1, 4), np.float32)
    crossed = 1.5 * cell
    for row in range(found.shape[0]):
        for col in range(found.shape[1]):
            d00, d01, d10, d11 = table[row, col], table[row, col + 1], table[row + 1, col], table[row + 1, col + 1]
            if abs(d00) > crossed or abs(d01) > crossed or abs(d10) > crossed or abs(d11) > crossed:
                d00, d01, d10, d11 = abs(d00), abs(d01), abs(d10), abs(d11)
            found[row, col, 0], found[row, col, 1] = d00, d01 - d00
            found[row, col, 2], found[row, col, 3] = d10 - d00, d11 - d10 - d01 + d00
    return found
