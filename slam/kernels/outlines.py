"""Four-sided outlines of a picture's dark regions.

A region's outer border is followed from pixel to pixel (Moore), and cut where it is farthest from straight: Ramer, "An iterative
procedure for the polygonal approximation of plane curves" (1972), until there are four sides. A line through each side's pixels, and
where two of them meet, is better than the pixel there: corners are round.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.regions import first_pixels

Dark = NDArray[np.uint8]
Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
DIAGONAL = 0.7
"""Pixels of a side for each pixel of its length, at least."""
LONGEST = 4
"""No marker's outline is longer than so many times the picture [px]."""
CROOKED = 0.03
"""Largest distance of an outline from its sides, as a share of its length."""
CLOSE = 0.05
"""Least distance of two corners, as a share of the outline's length."""
ENDS = 0.15
"""Part of a side that is left out at each end of it."""
MARGIN = 3
"""What has corners nearer to the picture's edge is cut off [px]."""
ROWS = np.array([0, -1, -1, -1, 0, 1, 1, 1], np.int32)
COLUMNS = np.array([-1, -1, 0, 1, 1, 1, 0, -1], np.int32)
"""Steps to the eight neighbours, from the west on clockwise in the picture."""


@njit
def four_sided(dark: Dark, width: int, least: float) -> Floats:
    """Corners (N, 4, 2) of what is four-sided, clockwise in the picture, right to half a pixel or so [px].

    Args:
        dark: (H + 2, at least W + 2) 1 where the picture is dark, in a frame of zeros.
        width: W.
        least: length of a side [px].
    """
    height = len(dark) - 2
    starts = first_pixels(dark, DIAGONAL * least)
    outline = np.empty((LONGEST * max(width, height), 2), np.int32)
    corners, count = np.empty((len(starts), 4, 2)), 0
    for k in range(len(starts)):
        length = _follow(dark, starts[k], outline)
        if length >= 4.0 * DIAGONAL * least and _cut(outline[:length], corners[count]) and _inside(corners[count], width, height):
            count += 1
    return corners[:count]


@njit
def _follow(dark: Dark, start: Ints, outline: Ints) -> int:
    """Write columns and rows of a region's outer border, clockwise from its first pixel; returns how many, 0 when there are too many."""
    y, x = start
    count, first, back = 0, -1, 0  # the neighbour to the west of the first pixel is not dark
    while count < len(outline):
        turn = -1
        for k in range(1, 9):
            turn = (back + k) % 8
            if dark[y + ROWS[turn], x + COLUMNS[turn]] != 0:
                break
        if dark[y + ROWS[turn], x + COLUMNS[turn]] == 0:
            return 0  # one pixel alone
        if y == start[0] and x == start[1] and turn == first:
            return count
        if count == 0:
            first = turn
        outline[count, 0], outline[count, 1] = x - 1, y - 1
        count += 1
        y, x, back = y + ROWS[turn], x + COLUMNS[turn], (turn + 4) % 8
    return 0


@njit
def _cut(outline: Ints, corners: Floats) -> bool:
    """Write the corners (4, 2) of an outline; False when it is not four-sided and convex."""
    length, at = len(outline), np.empty(4, np.int32)
    a = _farthest(outline, 0)
    b = _farthest(outline, a)
    at[0], at[1] = min(a, b), max(a, b)
    for known in range(2, 5):
        side, pixel, away = 0, 0, -1.0
        for k in range(known):
            where, off = _bulge(outline, at[k], at[(k + 1) % known])
            if off > away:
                side, pixel, away = k, where, off
        if known == 4:
            if away > CROOKED * length:
                return False
        else:
            for k in range(known, side + 1, -1):
                at[k] = at[k - 1]
            at[side + 1] = pixel
    for k in range(4):
        corners[k] = outline[at[k], 0], outline[at[k], 1]
    least = CLOSE * length
    return _convex(corners, least) and _straighten(outline, at, corners) and _convex(corners, least)


@njit
def _farthest(outline: Ints, start: int) -> int:
    best, at = -1, start
    for k in range(len(outline)):
        dx, dy = outline[k, 0] - outline[start, 0], outline[k, 1] - outline[start, 1]
        away = dx * dx + dy * dy
        if away > best:
            best, at = away, k
    return at


@njit
def _bulge(outline: Ints, first: int, last: int) -> tuple[int, float]:
    """Where from one pixel to another the outline is farthest from the line between them, and how far [px]."""
    ax, ay = outline[first, 0], outline[first, 1]
    ux, uy = outline[last, 0] - ax, outline[last, 1] - ay
    best, at, k = -1, first, first
    while k != last:
        away = abs((outline[k, 0] - ax) * uy - (outline[k, 1] - ay) * ux)
        if away > best:
            best, at = away, k
        k = k + 1 if k + 1 < len(outline) else 0
    return at, best / max(np.hypot(ux, uy), 1.0)


@njit
def _convex(corners: Floats, least: float) -> bool:
    """Every corner turns clockwise, and neighbours are at least so far apart [px]."""
    for k in range(4):
        a, b, c = corners[k - 1], corners[k], corners[(k + 1) % 4]
        ux, uy, vx, vy = b[0] - a[0], b[1] - a[1], c[0] - b[0], c[1] - b[1]
        if not (ux * vy - uy * vx > 0.0 and ux * ux + uy * uy >= least * least):
            return False
    return True


@njit
def _straighten(outline: Ints, at: Ints, corners: Floats) -> bool:
    """Move the corners to where the sides' lines meet: least squares through pixels, half a pixel out, where those end."""
    lines = np.empty((4, 3))  # normal, out of the region, and distance from the picture's first pixel
    for k in range(4):
        count = (at[(k + 1) % 4] - at[k]) % len(outline)
        skip = int(ENDS * count)
        n, sx, sy, sxx, sxy, syy = 0, 0, 0, 0, 0, 0
        for i in range(skip, count - skip + 1):
            x, y = outline[(at[k] + i) % len(outline)]
            n, sx, sy = n + 1, sx + x, sy + y
            sxx, sxy, syy = sxx + x * x, sxy + x * y, syy + y * y
        angle = 0.5 * np.arctan2(2.0 * (sxy - sx * sy / n), (sxx - sx * sx / n) - (syy - sy * sy / n))
        nx, ny = np.sin(angle), -np.cos(angle)
        if nx * (corners[k, 1] - corners[(k + 1) % 4, 1]) - ny * (corners[k, 0] - corners[(k + 1) % 4, 0]) > 0.0:
            nx, ny = -nx, -ny
        lines[k] = nx, ny, (nx * sx + ny * sy) / n + 0.5
    for k in range(4):
        a, b = lines[k - 1], lines[k]
        cross = a[0] * b[1] - a[1] * b[0]
        if abs(cross) < 0.05:
            return False
        corners[k] = (a[2] * b[1] - b[2] * a[1]) / cross, (a[0] * b[2] - b[0] * a[2]) / cross
    return True


@njit
def _inside(corners: Floats, width: int, height: int) -> bool:
    for k in range(4):
        x, y = corners[k]
        if not (x >= MARGIN and y >= MARGIN and x < width - MARGIN and y < height - MARGIN):
            return False
    return True
