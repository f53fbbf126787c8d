"""Sums of the scores of a scan's points at the nodes of a branch-and-bound search, four at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.lattice import Integers, Lattice, Node
from slam.kernels.merging import Clouds
from slam.kernels.score_tables import Scores

Tables = tuple[Scores, int]
"""Score tables (L + 1, H, W), the first of the cells, table h of the best in 2^h + 2 m cells to each side; score off the tables."""
Work = tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], Integers, Integers, NDArray[np.bool_]]
"""Rows, columns and flat cells of the points of every level and group; where each level begins; lowest and highest row and column
(L + 1, T, 4); which groups are turned already."""
Problem = tuple[Tables, Clouds, Lattice, Work]
FIRST_MERGED = 2
"""Level below which a cell has no room for merging points: m is 0."""


@njit
def room_for(clouds: Clouds, lattice: Lattice) -> Work:
    """Room for the cells of all levels and groups of headings."""
    begins, groups = clouds[2], clouds[3]
    headings = 2 * lattice[3] + 1
    room = np.zeros(len(groups) + 1, np.int64)
    room[1:] = np.cumsum((headings + groups - 1) // groups * (begins[1:] - begins[:-1]))
    rows, cols, places = np.empty(room[-1], np.int32), np.empty(room[-1], np.int32), np.empty(room[-1], np.int32)
    return rows, cols, places, room, np.empty((len(groups), headings, 4), np.int64), np.zeros((len(groups), headings), np.bool_)


@njit
def look_up(problem: Problem, node: Node, apart: int, sums: Integers) -> None:
    """Write the sums (4,) of the bounds of four nodes: one, and those `apart` cells to its right, above it, and both."""
    (levels, _), (_, beams, begins, _), _, work = problem
    level, group, row, col = node
    if not work[5][level, group]:
        _turn(problem, level, group)
    first, last = begins[level], begins[level + 1]
    start = work[3][level] + group * (last - first)
    scores, end = levels[level], start + last - first
    height, width = scores.shape
    row, col = row - (1 << level) // 4, col - (1 << level) // 4
    low_row, high_row, low_col, high_col = work[4][level, group]
    if low_row + row < 0 or low_col + col < 0 or high_row + row + apart >= height or high_col + col + apart >= width:
        _add_clamped((work[0][start:end], work[1][start:end], beams[first:last]), scores, (row, col, apart), sums)
    elif level < FIRST_MERGED:
        _add(work[2][start:end], scores, (row * width + col, apart), sums)
    else:
        _add_weighed(work[2][start:end], beams[first:last], scores, (row * width + col, apart), sums)


@njit
def _add(places: NDArray[np.int32], scores: Scores, at: tuple[int, int], sums: Integers) -> None:
    """`look_up` of points at flat cells (N,), each of one beam: more than twice as fast as the weighed one."""
    flat, shift = scores.reshape(-1), at[0]
    right, up = np.uint64(at[1]), np.uint64(at[1] * scores.shape[1])
    a, b, c, d = 0, 0, 0, 0
    for i in range(len(places)):
        place = np.uint64(places[i] + shift)
        a += flat[place]
        b += flat[place + right]
        c += flat[place + up]
        d += flat[place + up + right]
    sums[0], sums[1], sums[2], sums[3] = a, b, c, d


@njit
def _add_weighed(places: NDArray[np.int32], beams: Integers, scores: Scores, at: tuple[int, int], sums: Integers) -> None:
    """`look_up` of points at flat cells (N,)."""
    flat, shift = scores.reshape(-1), at[0]
    right, up = np.uint64(at[1]), np.uint64(at[1] * scores.shape[1])
    a, b, c, d = 0, 0, 0, 0
    for i in range(len(places)):
        place, n = np.uint64(places[i] + shift), beams[i]
        a += n * flat[place]
        b += n * flat[place + right]
        c += n * flat[place + up]
        d += n * flat[place + up + right]
    sums[0], sums[1], sums[2], sums[3] = a, b, c, d


@njit
def _add_clamped(
    cells: tuple[NDArray[np.int32], NDArray[np.int32], Integers], scores: Scores, at: tuple[int, int, int], sums: Integers
) -> None:
    """`look_up` where some points fall off the table: they have the score of its border."""
    rows, cols, beams = cells
    height, width = scores.shape
    flat = scores.reshape(-1)
    row, col, apart = at
    a, b, c, d = 0, 0, 0, 0
    for i in range(len(rows)):
        y, x, n = rows[i] + row, cols[i] + col, beams[i]
        low, high = min(max(y, 0), height - 1) * width, min(max(y + apart, 0), height - 1) * width
        left, right = min(max(x, 0), width - 1), min(max(x + apart, 0), width - 1)
        a += n * flat[np.uint64(low + left)]
        b += n * flat[np.uint64(low + right)]
        c += n * flat[np.uint64(high + left)]
        d += n * flat[np.uint64(high + right)]
    sums[0], sums[1], sums[2], sums[3] = a, b, c, d


@njit
def _turn(problem: Problem, level: int, group: int) -> None:
    """Write the cells of a level's points at the middle heading of a group of headings, the centre's shift."""
    (levels, _), (points, _, begins, groups), (centre, step, _, turns, _, _), (rows, cols, places, room, extents, done) = problem
    yaw = centre[2] + (group * groups[level] + 0.5 * (groups[level] - 1) - turns) * step
    c, s = np.cos(yaw), np.sin(yaw)
    first, last = begins[level], begins[level + 1]
    start = room[level] + group * (last - first)
    low_row, high_row, low_col, high_col = np.int64(1 << 40), np.int64(-1 << 40), np.int64(1 << 40), np.int64(-1 << 40)
    for i in range(last - first):
        x, y = points[first + i, 0], points[first + i, 1]
        col, row = int(np.floor(centre[0] + c * x - s * y)), int(np.floor(centre[1] + s * x + c * y))
        rows[start + i], cols[start + i], places[start + i] = row, col, row * levels.shape[2] + col
        low_row, high_row = min(low_row, row), max(high_row, row)
        low_col, high_col = min(low_col, col), max(high_col, col)
    extent = extents[level, group]
    extent[0], extent[1], extent[2], extent[3] = low_row, high_row, low_col, high_col
    done[level, group] = True
