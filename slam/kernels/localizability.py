"""What a scan's own geometry can tell of its pose: Censi, "On achievable accuracy for range-finder localization" (2007)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Noise = tuple[float, float]
"""Standard deviation of a range: least [m], and as a share of the range."""
Line = tuple[float, float, float, float, float, float, float]
"""Points, middle x and y, normal x and y, sums of squares along and across."""

RANGE_NOISE = (0.01, 0.01)
"""Of ranges: 1 cm, beyond 1 m one percent; how straight the scan's own lines are corrects it up to a factor."""
FEWEST = 4
"""Points that make a line."""
GRAZING = 0.1
"""Least cosine of an incidence angle that is believed."""
STRAIGHT = 1.6
"""A line's points scatter at most so many times as far as ranges do."""
TURNING = 0.9
"""Share of the steps from point to point that go the same way round in a scan that is in order."""
VAGUE = 0.1
"""Largest variance of a normal's direction that is of use [rad^2]."""


@njit
def in_order(points: Floats) -> Floats:
    """The finite ones of points (M, 2), as they are where they go round the origin one way, else by rising bearing."""
    kept = np.empty((len(points), 2))
    n, left = 0, 0
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        if not (np.isfinite(x) and np.isfinite(y)):
            continue
        if n > 0:
            left += kept[n - 1, 0] * y - kept[n - 1, 1] * x >= 0.0
        kept[n, 0], kept[n, 1] = x, y
        n += 1
    kept = kept[:n]
    if abs(2 * left - n) >= (2.0 * TURNING - 1.0) * n:
        return kept
    return kept[np.argsort(np.arctan2(kept[:, 1], kept[:, 0]), kind="mergesort")]


@njit
def information(points: Floats, noise: Noise) -> Floats:
    """Fisher information (3, 3) of (x, y, yaw) in the points' own frame [1/m, 1/rad], from points (M, 2) [m] in any order.

    The scan is split into straight lines, whose normals are far better known than those of a few neighbouring points:
    scattered normals alone claim to know the way along a corridor to a centimetre.
    """
    points = in_order(points)
    sums = running_sums(points)
    total = np.zeros((3, 3))
    todo = np.empty((len(points) + 1, 2), np.int64)
    todo[0, 0], todo[0, 1] = 0, len(points)
    waiting, start, end = 1, 0, 0  # a line is held back until its successor does not go on with it
    squares, free = 0.0, 0.0
    while waiting > 0:
        waiting -= 1
        first, last = todo[waiting, 0], todo[waiting, 1]
        if last - first < FEWEST:
            continue
        if not _straight(_line(sums, first, last), noise):
            middle = _farthest(points, first, last)
            todo[waiting, 0], todo[waiting, 1] = middle, last
            todo[waiting + 1, 0], todo[waiting + 1, 1] = first, middle
            waiting += 2
        elif end > start and first - end < FEWEST and _straight(_line(sums, start, last), noise):
            end = last
        else:
            squares, free = _add_line(total, points[start:end], _line(sums, start, end), noise, (squares, free))
            start, end = first, last
    squares, free = _add_line(total, points[start:end], _line(sums, start, end), noise, (squares, free))
    # ranges are as good as the lines are straight, within reason
    return total / (min(max(squares / free, 0.1), 2.0) if free > 0.0 else 1.0)


@njit
def running_sums(points: Floats) -> Floats:
    """(M + 1, 5) sums of x, y, x^2, x y, y^2 before each point."""
    sums = np.zeros((len(points) + 1, 5))
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        sums[i + 1, 0] = sums[i, 0] + x
        sums[i + 1, 1] = sums[i, 1] + y
        sums[i + 1, 2] = sums[i, 2] + x * x
        sums[i + 1, 3] = sums[i, 3] + x * y
        sums[i + 1, 4] = sums[i, 4] + y * y
    return sums


@njit
def scatter(sums: Floats, first: int, last: int) -> tuple[float, float, float, float, float]:
    """Middle x, y and sums of squares x x, x y, y y about it, of the points from `first` to before `last`, by their running sums."""
    n = float(last - first)
    mx, my = (sums[last, 0] - sums[first, 0]) / n, (sums[last, 1] - sums[first, 1]) / n
    a = sums[last, 2] - sums[first, 2] - n * mx * mx
    b = sums[last, 3] - sums[first, 3] - n * mx * my
    d = sums[last, 4] - sums[first, 4] - n * my * my
    return mx, my, a, b, d


@njit
def _line(sums: Floats, first: int, last: int) -> Line:
    """The line nearest to the points from `first` to before `last`."""
    n = float(last - first)
    if n < 1.0:
        return 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
    mx, my, a, b, d = scatter(sums, first, last)
    spread = np.sqrt(0.25 * (a - d) ** 2 + b * b)
    angle = 0.5 * np.arctan2(2.0 * b, a - d)
    return n, mx, my, -np.sin(angle), np.cos(angle), max(0.5 * (a + d) + spread, 1e-12), max(0.5 * (a + d) - spread, 0.0)


@njit
def _variance(line: Line, noise: Noise) -> float:
    """Of the distance to the line of points that range noise has moved [m^2]."""
    _, mx, my, nx, ny, _, _ = line
    r = np.hypot(mx, my)
    cosine = max(abs(nx * mx + ny * my) / max(r, 1e-9), GRAZING)
    return (max(noise[0], noise[1] * r) * cosine) ** 2


@njit
def _straight(line: Line, noise: Noise) -> bool:
    return line[6] <= STRAIGHT * STRAIGHT * _variance(line, noise) * line[0]


@njit
def _farthest(points: Floats, first: int, last: int) -> int:
    """The point farthest from the way from the first to the last, neither of them."""
    x, y = points[first, 0], points[first, 1]
    dx, dy = points[last - 1, 0] - x, points[last - 1, 1] - y
    worst, at = -1.0, (first + last) // 2
    for i in range(first + 1, last - 1):
        off = abs(dx * (points[i, 1] - y) - dy * (points[i, 0] - x))
        if off > worst:
            worst, at = off, i
    return at


@njit
def _add_line(total: Floats, points: Floats, line: Line, noise: Noise, fit: tuple[float, float]) -> tuple[float, float]:
    """Add the information of a line's points to `total`, and to `fit` its squared residuals in deviations and how many of them are free.

    Where the points clearly bend, as about a pillar or in a round room, the normals turn with them.
    """
    n, mx, my, nx, ny, along, across = line
    if n < FEWEST:
        return fit
    variance = _variance(line, noise)
    tilt = max(variance, across / n) / along  # variance of the normal's direction
    if tilt > VAGUE:
        return fit
    bend, doubt = _bend(points, line, variance)
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        place = ny * (x - mx) - nx * (y - my)
        turn = bend * place
        ux, uy = nx + turn * ny, ny - turn * nx
        # a normal that is off seems to know something along the line
        _add(total, 1.0 / variance, ux, uy, uy * x - ux * y)
        _add(total, -(tilt + doubt * place * place) / variance, uy, -ux, -ux * x - uy * y)
    return fit[0] + across / variance, fit[1] + n - 2.0


@njit
def _bend(points: Floats, line: Line, variance: float) -> tuple[float, float]:
    """Curvature of points that lie along a parabola rather than a line [1/m], and its variance; 0 where it may be noise."""
    n, mx, my, nx, ny, along, _ = line
    middle, product, square = along / n, 0.0, 0.0
    for i in range(len(points)):
        x, y = points[i, 0] - mx, points[i, 1] - my
        arch = (ny * x - nx * y) ** 2 - middle
        product += arch * (nx * x + ny * y)
        square += arch * arch
    if product * product <= 9.0 * variance * square:
        return 0.0, 0.0
    return -2.0 * product / square, 4.0 * variance / square


@njit
def _add(total: Floats, weight: float, x: float, y: float, turn: float) -> None:
    """Add weight (x, y, turn)^T (x, y, turn)."""
    total[0, 0] += weight * x * x
    total[0, 1] += weight * x * y
    total[1, 1] += weight * y * y
    total[0, 2] += weight * x * turn
    total[1, 2] += weight * y * turn
    total[2, 2] += weight * turn * turn
    total[1, 0], total[2, 0], total[2, 1] = total[0, 1], total[0, 2], total[1, 2]
