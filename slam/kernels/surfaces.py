"""The nearest-surface field: for every cell the nearest occupied cell, and for every occupied cell the line through its hits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

X, Y, NORMAL_X, NORMAL_Y, FLATNESS = 0, 1, 2, 3, 4
"""Columns of a surface element: a point on it [m], its unit normal, and 0 for a lone point, 1 for a line, 2 for a line that was seen
from one side only, to which its normal points. Negative: hits that may be of one wall and gather as such, but are matched as points."""

ONE_SIDED = 2.0

Field = tuple[NDArray[np.int32], NDArray[np.float32], float]
"""Nearest occupied flat cell (H, W), its surfaces (H, W, 5), cell size [m]."""

FACING = 0.1
"""Smallest mean component along the normal of the directions from which a line was seen, that tells its side."""

FLAT, GATHERED = 0.05, 0.15
"""Largest ratios of the variances across and along, of hits that make a line, and of hits that gather along one if they scatter little.
The slanted line through the hits of two walls at a corner would draw every scan into it."""

NOISE = 0.025
"""Hits that scatter no more than this across [m] gather along a line: a wall that has not been hit often."""


@njit
def occupied_around(occupied: NDArray[np.bool_], cells: NDArray[np.int64], reach: int) -> NDArray[np.int64]:
    """Flat indices, each once and ascending, of the occupied cells within `reach` rows and columns of the flat cells."""
    height, width = occupied.shape
    found = np.empty(len(cells) * (2 * reach + 1) ** 2, np.int64)
    n = 0
    for i in range(len(cells)):
        row, col = cells[i] // width, cells[i] % width
        for r in range(max(row - reach, 0), min(row + reach + 1, height)):
            for c in range(max(col - reach, 0), min(col + reach + 1, width)):
                if occupied[r, c]:
                    found[n] = r * width + c
                    n += 1
    return np.unique(found[:n])


@njit
def attach(field: NDArray[np.int32], squares: NDArray[np.int32], cells: NDArray[np.int64], radius: int) -> None:
    """Offer newly occupied flat cells to every cell within `radius`: the nearer occupied cell stays.

    Writes `field` (H, W) and the squared distance in cells `squares` (H, W), `radius`^2 + 1 where there is none.
    """
    height, width = field.shape
    for i in range(len(cells)):
        row, col = cells[i] // width, cells[i] % width
        for r in range(max(row - radius, 0), min(row + radius + 1, height)):
            for c in range(max(col - radius, 0), min(col + radius + 1, width)):
                d2 = (r - row) ** 2 + (c - col) ** 2
                if d2 > radius * radius:
                    continue
                if d2 < squares[r, c]:
                    field[r, c], squares[r, c] = cells[i], d2


@njit
def detach(
    field: NDArray[np.int32], squares: NDArray[np.int32], occupied: NDArray[np.bool_], cells: NDArray[np.int64], around: NDArray[np.int32]
) -> None:
    """Take cells that are occupied no longer out of the field and let their neighbours' surfaces move in. Writes as `attach`.

    `around` is `nearest_first` of its radius.
    """
    height, width = field.shape
    for i in range(len(cells)):
        row, col = cells[i] // width, cells[i] % width
        for k in range(len(around)):
            r, c = row + around[k, 1], col + around[k, 2]
            if 0 <= r < height and 0 <= c < width and field[r, c] == cells[i]:
                field[r, c], squares[r, c] = _search(occupied, r, c, around)


@njit
def nearest_first(radius: int) -> NDArray[np.int32]:
    """Squared distance, rows and columns (K, 3) to all cells within `radius`, the nearest first, then row by row."""
    side = 2 * radius + 1
    found, n = np.empty((side * side, 3), np.int32), 0
    for d2 in range(radius * radius + 1):
        for r in range(-radius, radius + 1):
            for c in range(-radius, radius + 1):
                if r * r + c * c == d2:
                    found[n] = d2, r, c
                    n += 1
    return found[:n]


@njit
def _search(occupied: NDArray[np.bool_], row: int, col: int, around: NDArray[np.int32]) -> tuple[int, int]:
    """Flat index and squared distance in cells of the nearest occupied cell within the radius; -1 and radius^2 + 1 for none."""
    height, width = occupied.shape
    for k in range(len(around)):
        r, c = row + around[k, 1], col + around[k, 2]
        if 0 <= r < height and 0 <= c < width and occupied[r, c]:
            return r * width + c, around[k, 0]
    return -1, around[-1, 0] + 1


@njit
def move(old: NDArray[np.int32], new: NDArray[np.int32], shift: tuple[int, int]) -> None:
    """Write the flat cells of a field (h, w) into a larger one (H, W) whose cell (row, col) + `shift` is the old one's (row, col)."""
    width, wider = old.shape[1], new.shape[1]
    for row in range(old.shape[0]):
        for col in range(width):
            cell = old[row, col]
            if cell >= 0:
                new[row + shift[0], col + shift[1]] = (cell // width + shift[0]) * wider + cell % width + shift[1]


@njit
def fit(
    surfaces: NDArray[np.float32],
    occupied: NDArray[np.bool_],
    hits: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]],
    cells: NDArray[np.int64],
    scales: tuple[float, NDArray[np.int64]],
) -> None:
    """Fit the surface of each flat cell to the mean hits around it. Writes `surfaces` (H, W, 5).

    The neighbourhood grows until three occupied cells are found: far walls are hit sparsely. Pooling across cells also
    removes the bias of a wall that lies on a cell border.

    Args:
        surfaces: written.
        occupied: (H, W).
        hits: hit count (H, W), mean hit minus cell centre (H, W, 2) [m], mean unit vector towards the viewer (H, W, 2).
        cells: flat cells to fit.
        scales: cell size [m]; cells to each side of the neighbourhoods, ascending.
    """
    resolution, reaches = scales
    width = occupied.shape[1]
    offset = hits[1]
    for i in range(len(cells)):
        row, col = cells[i] // width, cells[i] % width
        surface = surfaces[row, col]
        surface[X], surface[Y] = offset[row, col, 0], offset[row, col, 1]
        surface[FLATNESS] = 0.0
        for reach in reaches:
            moments = _pool(occupied, hits, (row, col, reach), resolution)
            if moments[0] >= 3:
                _fit_line(surface, moments)
                break
        surface[X] += (col + 0.5) * resolution
        surface[Y] += (row + 0.5) * resolution


Moments = tuple[int, float, float, float, float, float, float, float, float]
"""Cells, weight, and weighted sums of x, y, x^2, x y, y^2 and of the directions towards the viewer."""


@njit
def _pool(
    occupied: NDArray[np.bool_],
    hits: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]],
    place: tuple[int, int, int],
    resolution: float,
) -> Moments:
    """Moments of the mean hits of the occupied cells about (row, col), within `reach` rows and columns, about the cell's centre.

    Cells that were seen from the other side belong to another face of the wall.
    """
    height, width = occupied.shape
    count, offset, facing = hits
    row, col, reach = place
    n, total, mx, my, xx, xy, yy, fx, fy = 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    vx, vy = facing[row, col, 0], facing[row, col, 1]
    for r in range(max(row - reach, 0), min(row + reach + 1, height)):
        for c in range(max(col - reach, 0), min(col + reach + 1, width)):
            if not occupied[r, c] or vx * facing[r, c, 0] + vy * facing[r, c, 1] < 0.0:
                continue
            w = count[r, c]
            x = (c - col) * resolution + offset[r, c, 0]
            y = (r - row) * resolution + offset[r, c, 1]
            n += 1
            total += w
            mx += w * x
            my += w * y
            xx += w * x * x
            xy += w * x * y
            yy += w * y * y
            fx += w * facing[r, c, 0]
            fy += w * facing[r, c, 1]
    return n, total, mx, my, xx, xy, yy, fx, fy


@njit
def _fit_line(surface: NDArray[np.float32], moments: Moments) -> None:
    """Store mean and normal where the points lie along a line: the normal is the eigenvector of the smaller eigenvalue."""
    _, total, mx, my, xx, xy, yy, fx, fy = moments
    if total <= 0.0:
        return
    mx, my = mx / total, my / total
    a, b, d = xx / total - mx * mx, xy / total - mx * my, yy / total - my * my
    spread = np.sqrt(0.25 * (a - d) ** 2 + b * b)
    large, small = 0.5 * (a + d) + spread, max(0.5 * (a + d) - spread, 0.0)
    if small > max(FLAT * large, min(GATHERED * large, NOISE * NOISE)):
        return
    angle = 0.5 * np.arctan2(2.0 * b, a - d)
    nx, ny = -np.sin(angle), np.cos(angle)
    side = (nx * fx + ny * fy) / total
    turn = -1.0 if side < 0.0 else 1.0
    surface[NORMAL_X], surface[NORMAL_Y] = turn * nx, turn * ny
    sides = ONE_SIDED if abs(side) > FACING else 1.0
    if small <= FLAT * large:
        surface[X], surface[Y], surface[FLATNESS] = mx, my, sides
    else:  # the cell's own mean, moved onto the line
        off = nx * (mx - surface[X]) + ny * (my - surface[Y])
        surface[X], surface[Y], surface[FLATNESS] = surface[X] + off * nx, surface[Y] + off * ny, -sides
