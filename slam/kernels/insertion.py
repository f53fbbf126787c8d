"""Ray-traced insertion of a scan into a log-odds grid. Coordinates are in the grid's own frame: the corner of cell (0, 0) is the origin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.surfaces import FLATNESS, NORMAL_X, NORMAL_Y, ONE_SIDED, X, Y
from slam.kernels.traversal import ray_through_cells

HIT, MISS = 1, 2

Cells = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
"""Log-odds (H, W), hit count (H, W), mean hit minus cell centre (H, W, 2) [m], mean unit vector towards the viewer (H, W, 2)."""


@njit
def insert_hits(
    origins: NDArray[np.float64],
    points: NDArray[np.float64],
    field: tuple[NDArray[np.int32], NDArray[np.float32], float],
    cells: Cells,
    touched: NDArray[np.uint8],
    update: tuple[float, float, float],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Raise the log-odds of every hit cell once and average its hits.

    Returns the flat indices of the hit cells, and where each ray ends (M, 2) [m]: at its hit, but never behind the line that the hit
    counts for, lest range noise erode walls from the front and leave only the hits that lie too deep.

    A hit near a known line counts for the cell where the line is, with its own coordinates: range noise then averages
    out on both sides of a wall, instead of filling the cells before and behind it. No hit fades: scans are placed by the map that
    they go into, so a map that forgot its oldest hits would slowly follow its own errors.

    Args:
        origins: (M, 2) [m] where each ray starts, in the grid's frame.
        points: (M, 2) [m] where it ends.
        field: nearest occupied flat cell (H, W), its surfaces (H, W, 5), cell size [m].
        cells: written.
        touched: (H, W) HIT where this scan hit; written, to be cleared by `clear`.
        update: log-odds of a hit, their limit, how near a line is near [m].
    """
    log_odds, count, offset, facing = cells
    resolution = field[2]
    height, width = log_odds.shape
    hits, ends = np.empty(len(points), np.int64), points.copy()
    n = 0
    for i in range(len(points)):
        vx, vy = origins[i, 0] - points[i, 0], origins[i, 1] - points[i, 1]
        length = np.sqrt(vx * vx + vy * vy)
        if length > 0.0:
            vx, vy = vx / length, vy / length
        x, y = _foot((points[i, 0], points[i, 1]), (vx, vy), field, update[2])
        dx, dy = x - points[i, 0], y - points[i, 1]
        if vx * dx + vy * dy > 0.0:  # the hit lies behind its line, by d along the normal: the ray meets the line before
            back = (dx * dx + dy * dy) / (vx * dx + vy * dy)
            ends[i, 0], ends[i, 1] = points[i, 0] + min(back, length) * vx, points[i, 1] + min(back, length) * vy
        col, row = int(np.floor(x / resolution)), int(np.floor(y / resolution))
        if not (0 <= row < height and 0 <= col < width):
            continue
        count[row, col] += 1.0
        gain = 1.0 / count[row, col]
        offset[row, col, 0] += gain * (points[i, 0] - (col + 0.5) * resolution - offset[row, col, 0])
        offset[row, col, 1] += gain * (points[i, 1] - (row + 0.5) * resolution - offset[row, col, 1])
        facing[row, col, 0] += gain * (vx - facing[row, col, 0])
        facing[row, col, 1] += gain * (vy - facing[row, col, 1])
        if touched[row, col] != HIT:
            touched[row, col] = HIT
            log_odds[row, col] = min(log_odds[row, col] + update[0], update[1])
            hits[n] = row * width + col
            n += 1
    return hits[:n].copy(), ends


@njit
def _foot(
    point: tuple[float, float], view: tuple[float, float], field: tuple[NDArray[np.int32], NDArray[np.float32], float], near: float
) -> tuple[float, float]:
    """The point's foot on the nearest line, seen from its side, when that is nearer than `near` [m], else the point."""
    nearest, surfaces, resolution = field
    height, width = nearest.shape
    x, y = point
    col, row = int(np.floor(x / resolution)), int(np.floor(y / resolution))
    if not (0 <= row < height and 0 <= col < width) or nearest[row, col] < 0:
        return x, y
    surface = surfaces[nearest[row, col] // width, nearest[row, col] % width]
    if surface[FLATNESS] == 0.0:
        return x, y
    if _behind(surface, view):
        at = _face(point, view, field, near)
        if at < 0:
            return x, y
        surface = surfaces[at // width, at % width]
    if (x - surface[X]) ** 2 + (y - surface[Y]) ** 2 > (2.0 * near) ** 2:
        return x, y
    d = surface[NORMAL_X] * (x - surface[X]) + surface[NORMAL_Y] * (y - surface[Y])
    if abs(d) > near:
        return x, y
    return x - d * surface[NORMAL_X], y - d * surface[NORMAL_Y]


@njit
def _behind(surface: NDArray[np.float32], view: tuple[float, float]) -> bool:
    """Whether a viewer in this direction is on the unseen side of the line."""
    return abs(surface[FLATNESS]) == ONE_SIDED and surface[NORMAL_X] * view[0] + surface[NORMAL_Y] * view[1] < 0.0


@njit
def _face(
    point: tuple[float, float], view: tuple[float, float], field: tuple[NDArray[np.int32], NDArray[np.float32], float], near: float
) -> int:
    """Flat cell of the nearest line seen from the viewer's side, of those in the cells within `near` [m]; -1 for none."""
    nearest, surfaces, resolution = field
    height, width = nearest.shape
    x, y = point
    col, row, reach = int(np.floor(x / resolution)), int(np.floor(y / resolution)), int(np.ceil(near / resolution - 1e-9))
    best, least = -1, near
    for r in range(max(row - reach, 0), min(row + reach + 1, height)):
        for c in range(max(col - reach, 0), min(col + reach + 1, width)):
            surface = surfaces[r, c]
            if nearest[r, c] != r * width + c or abs(surface[FLATNESS]) != ONE_SIDED or _behind(surface, view):
                continue
            d = abs(surface[NORMAL_X] * (x - surface[X]) + surface[NORMAL_Y] * (y - surface[Y]))
            if d < least:
                best, least = r * width + c, d
    return best


@njit
def absorb(
    cells: Cells,
    field: tuple[NDArray[np.int32], NDArray[np.float32], float],
    hits: NDArray[np.int64],
    near: float,
) -> NDArray[np.int64]:
    """Move the hits of a cell beside a wall into the cell of the wall that they belong to. Returns the emptied flat cells.

    Before a wall was known as a line its noise filled the cells behind it, where no ray ever passes to clear them.

    Args:
        cells: written.
        field: as in `insert_hits`.
        hits: flat cells to look at.
        near: how near a line is near [m].
    """
    log_odds, count, offset, facing = cells
    resolution = field[2]
    height, width = log_odds.shape
    emptied = np.empty(len(hits), np.int64)
    n = 0
    for i in range(len(hits)):
        row, col = hits[i] // width, hits[i] % width
        x = (col + 0.5) * resolution + offset[row, col, 0]
        y = (row + 0.5) * resolution + offset[row, col, 1]
        foot_x, foot_y = _foot((x, y), (facing[row, col, 0], facing[row, col, 1]), field, near)
        to_col, to_row = int(np.floor(foot_x / resolution)), int(np.floor(foot_y / resolution))
        if not (0 <= to_row < height and 0 <= to_col < width) or (to_row == row and to_col == col):
            continue
        if log_odds[to_row, to_col] <= 0.0 or count[to_row, to_col] <= count[row, col]:
            continue
        total = count[row, col] + count[to_row, to_col]
        gain = count[row, col] / total
        offset[to_row, to_col, 0] += gain * (x - (to_col + 0.5) * resolution - offset[to_row, to_col, 0])
        offset[to_row, to_col, 1] += gain * (y - (to_row + 0.5) * resolution - offset[to_row, to_col, 1])
        facing[to_row, to_col, 0] += gain * (facing[row, col, 0] - facing[to_row, to_col, 0])
        facing[to_row, to_col, 1] += gain * (facing[row, col, 1] - facing[to_row, to_col, 1])
        count[to_row, to_col] = total
        log_odds[row, col], count[row, col] = 0.0, 0.0
        emptied[n] = hits[i]
        n += 1
    return emptied[:n].copy()


@njit
def insert_misses(
    origins: NDArray[np.float64],
    points: NDArray[np.float64],
    resolution: float,
    cells: tuple[NDArray[np.float32], NDArray[np.float32]],
    touched: NDArray[np.uint8],
    update: tuple[float, float],
) -> NDArray[np.int64]:
    """Lower the log-odds of every cell that a ray crosses before its hit, once a scan. Returns the flat indices of the crossed cells.

    Cells hit by this scan are spared, so that grazing rays do not erase the wall they run along.

    Args:
        origins: (M, 2) [m] where each ray starts, in the grid's frame.
        points: (M, 2) [m] where it ends.
        resolution: cell size [m].
        cells: log-odds (H, W), hit count (H, W), which starts anew where a cell becomes more free than occupied; written.
        touched: (H, W) HIT, MISS or 0; written, to be cleared by `clear`.
        update: log-odds of a miss (negative) and their limit (positive).
    """
    log_odds, count = cells
    height, width = log_odds.shape
    crossed = np.empty(log_odds.size, np.int64)
    n = 0
    for i in range(len(points)):
        x, y = origins[i, 0] / resolution, origins[i, 1] / resolution
        dx, dy = points[i, 0] / resolution - x, points[i, 1] / resolution - y
        row, col, step_x, step_y, delta_x, delta_y, next_x, next_y, steps = ray_through_cells(x, y, dx, dy)
        for _ in range(steps):
            if 0 <= row < height and 0 <= col < width and touched[row, col] == 0:
                touched[row, col] = MISS
                log_odds[row, col] = max(log_odds[row, col] + update[0], -update[1])
                if log_odds[row, col] < 0.0:
                    count[row, col] = 0.0
                crossed[n] = row * width + col
                n += 1
            if next_x < next_y:
                next_x += delta_x
                col += step_x
            else:
                next_y += delta_y
                row += step_y
    return crossed[:n].copy()


@njit
def clear(touched: NDArray[np.uint8], cells: NDArray[np.int64]) -> None:
    """Reset the marks of the given flat cells."""
    flat = touched.reshape(-1)
    for i in range(len(cells)):
        flat[cells[i]] = 0
