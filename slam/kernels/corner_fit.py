"""Corners of a printed black square as the meeting points of lines fitted to its edges, with what the fit says of itself.

Across an edge the mean place of the grey level's slope, over a window that holds the whole of it, is the edge whatever the
blur: Tabatabai, Mitchell, "Edge location to subpixel values in digital imagery" (1984), in the form without a model of the edge.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.lens import Lens, to_pixel, to_ray

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8]
Fit = tuple[Floats, Floats, Floats, Floats]
"""Rays of the corners (N, 4, 2) and where they are seen [px]; covariances (N, 4, 2, 2) [px^2]; of each marker (N, 3) the residuals'
RMS [px], the least contrast of a side [grey levels] and the blur, the largest deviation of a side's slope [px]; nan where a side is
not seen."""

TRIM = 0.1
"""Part of a side that is left out at each end."""
MOST = (12, 20, 48)
"""Places along a side, at most, in each round of lines and corners: the first show where to look."""
STEP = 0.4
"""Between samples across an edge [px]."""
SEARCH, WIDER = 4.0, 0.25
"""How far an edge is searched for to both sides at first: so much [px], or this part of a module where that is more."""
WITHIN = 0.9
"""Part of a module in which nothing but the edge is: one module of border inside, one of white margin outside."""
APART = 0.6
"""Part of a module that the window may take once the blur is known: beyond it the slope of a white module inside comes in."""
WINDOW, SPREAD = 0.75, 2.2
"""Half of the window across an edge: so much [px] and so many standard deviations of its slope."""
ALIKE = 0.95
"""Least contrast of a side whose margin is free, as a share of the best side's."""
FEWEST = 5
"""Places that make a side."""
CORRELATED = 2.0
"""Neighbouring places, a pixel apart, share their errors as far as this [px]."""
FLOOR = 0.015
"""Error of a line that its residuals do not show [px]."""
OUTLIER = 3.0
"""Residuals beyond so many deviations are left out."""


@njit
def fit_corners(grey: Grey, corners: Floats, modules: Floats, lens: Lens) -> Fit:
    """Fit the corners of markers.

    Args:
        grey: (H, W).
        corners: (N, 4, 2) a guess that is right to a few pixels, clockwise in the picture [px].
        modules: (N,) modules along the side of each black square.
        lens: through which the picture was seen.
    """
    count = len(corners)
    rays, pixels, covariances, quality = np.empty((count, 4, 2)), corners.copy(), np.empty((count, 4, 2, 2)), np.empty((count, 3))
    for n in range(count):
        if not _fit_one(grey, pixels[n], modules[n], lens, (rays[n], covariances[n], quality[n])):
            rays[n], pixels[n], covariances[n], quality[n] = np.nan, np.nan, np.nan, np.nan
    return rays, pixels, covariances, quality


@njit
def _fit_one(grey: Grey, pixels: Floats, modules: float, lens: Lens, out: tuple[Floats, Floats, Floats]) -> bool:
    """Rounds of lines and corners, each from the corners of the one before."""
    rays, covariances, quality = out
    f = np.sqrt(lens[0] * lens[1])
    lines, points, spread = np.empty((4, 9)), np.empty((MOST[-1], 2)), np.full(4, -1.0)
    for most in MOST:
        for side in range(4):
            a, b = pixels[side], pixels[(side + 1) % 4]
            module = _across(pixels, side) / modules
            count, contrast, spread[side] = _edge(grey, (a, b), (module, spread[side]), points[:most])
            if count < FEWEST:
                return False
            for k in range(count):
                points[k] = to_ray(lens, points[k, 0], points[k, 1])
            _line(points[:count], lines[side])
            lines[side, 7] = contrast
        for side in range(4):
            if not _meet(lines[side - 1], lines[side], rays[side]):
                return False
            pixels[side] = to_pixel(lens, rays[side, 0], rays[side, 1])
    for side in range(4):
        lines[side, 8] = _systematic(lines[side], _across(pixels, side) / modules, (spread[side], np.max(lines[:, 7])))
    _summarise(lines, rays, f, covariances)
    quality[0] = f * np.sqrt(np.mean(lines[:, 5]))
    quality[1], quality[2] = np.min(lines[:, 7]), np.max(spread)
    return True


@njit
def _across(pixels: Floats, side: int) -> float:
    """Distance from the middle of a side to the line of the opposite one [px]."""
    a, b = pixels[side], pixels[(side + 1) % 4]
    c, d = pixels[(side + 2) % 4], pixels[(side + 3) % 4]
    x, y = 0.5 * (a[0] + b[0]) - c[0], 0.5 * (a[1] + b[1]) - c[1]
    u, v = d[0] - c[0], d[1] - c[1]
    return abs(x * v - y * u) / max(np.hypot(u, v), 1e-9)


@njit
def _half(module: float, spread: float) -> float:
    """Half of the window across an edge [px]."""
    return min(APART * module, WINDOW + SPREAD * spread)


@njit
def _systematic(line: Floats, module: float, look: tuple[float, float]) -> float:
    """Deviation of an edge that all its places share [px].

    White modules inside pull at it where modules are narrow; and a side that is paler than the others has something before its margin.
    """
    spread, brightest = look
    half = _half(module, spread)
    leak = 0.25 * half * math.erfc((module - half) / max(np.sqrt(2.0) * spread, 1e-9))
    return leak + half * max(ALIKE - line[7] / brightest, 0.0)


@njit
def _edge(grey: Grey, ends: tuple[Floats, Floats], window: tuple[float, float], points: Floats) -> tuple[int, float, float]:
    """Write points on the edge between two corners; returns how many, the mean contrast and the deviation of the slope [px].

    A deviation below 0 in `window` says that the edge is not known yet: then each place takes the window about its steepest slope.
    """
    (ax, ay), (bx, by) = ends
    module, spread = window
    length = max(np.hypot(bx - ax, by - ay), 1e-9)
    ux, uy = (bx - ax) / length, (by - ay) / length
    nx, ny = uy, -ux  # out of the black
    places = min(max(int(length * (1.0 - 2.0 * TRIM)), 8), len(points))
    half = min(WITHIN * module, max(SEARCH, WIDER * module)) if spread < 0.0 else _half(module, spread)
    steps = max(int(2.0 * half / STEP), 4)
    profile = np.empty(steps + 1)
    count, total, variance = 0, 0.0, 0.0
    for k in range(places):
        s = length * (TRIM + (1.0 - 2.0 * TRIM) * (k + 0.5) / places)
        x, y = ax + s * ux, ay + s * uy
        if not _sample(grey, (x, y), (nx, ny), half, profile):
            continue
        rise, place, deviation = _slope(profile, half) if spread >= 0.0 else _steepest(profile, half)
        if not (rise > 0.0 and abs(place) < half):
            continue
        points[count] = x + place * nx, y + place * ny
        count += 1
        total += rise
        variance += deviation * rise
    if count == 0:
        return 0, 0.0, spread
    return count, total / count, np.sqrt(max(variance / total, 0.0)) if spread < 0.0 else spread


@njit
def _sample(grey: Grey, at: tuple[float, float], normal: tuple[float, float], half: float, profile: Floats) -> bool:
    """Write the grey levels across an edge, bilinear; False where the picture ends."""
    height, width = grey.shape
    steps = len(profile) - 1
    x, y = at[0] - half * normal[0], at[1] - half * normal[1]
    dx, dy = 2.0 * half / steps * normal[0], 2.0 * half / steps * normal[1]
    last_x, last_y = x + steps * dx, y + steps * dy
    if not (min(x, last_x) >= 0.0 and min(y, last_y) >= 0.0 and max(x, last_x) < width - 1 and max(y, last_y) < height - 1):
        return False
    for k in range(steps + 1):
        i, j = int(x), int(y)
        fx, fy = x - i, y - j
        upper = (1.0 - fx) * grey[j, i] + fx * grey[j, i + 1]
        lower = (1.0 - fx) * grey[j + 1, i] + fx * grey[j + 1, i + 1]
        profile[k] = (1.0 - fy) * upper + fy * lower
        x += dx
        y += dy
    return True


@njit
def _slope(profile: Floats, half: float) -> tuple[float, float, float]:
    """Rise over the window, and the mean place of the slope in it [px]: noise does not pull it to a side, as all counts with its sign."""
    steps = len(profile) - 1
    between = 0.0
    for k in range(1, steps):
        between += profile[k]
    rise = profile[steps] - profile[0]
    area = (between + 0.5 * (profile[0] + profile[steps])) / steps
    return rise, half * (profile[0] + profile[steps] - 2.0 * area) / max(rise, 1e-9), 0.0


@njit
def _steepest(profile: Floats, half: float) -> tuple[float, float, float]:
    """Rise, mean place and variance of the rising slope about the steepest place [px]."""
    steps = len(profile) - 1
    step = 2.0 * half / steps
    peak, best = 0, 0.0
    for k in range(steps):
        if profile[k + 1] - profile[k] > best:
            peak, best = k, profile[k + 1] - profile[k]
    first, last = peak, peak  # as far as it keeps rising
    while first > 0 and profile[first] - profile[first - 1] > 0.1 * best:
        first -= 1
    while last < steps - 1 and profile[last + 2] - profile[last + 1] > 0.1 * best:
        last += 1
    total, moment, square = 0.0, 0.0, 0.0
    for k in range(first, last + 1):
        g, place = profile[k + 1] - profile[k], (k + 0.5) * step - half
        total, moment, square = total + g, moment + g * place, square + g * place * place
    mean = moment / max(total, 1e-9)
    return total, mean, square / max(total, 1e-9) - mean * mean


@njit
def _line(points: Floats, line: Floats) -> None:
    """Write middle x and y, direction x and y, length, variance of the residuals and their number: total least squares, trimmed twice."""
    limit, n, variance = np.inf, 0, 0.0
    mx, my, ux, uy = 0.0, 0.0, 1.0, 0.0
    for _ in range(3):
        n, sx, sy = 0, 0.0, 0.0
        sxx, sxy, syy = 0.0, 0.0, 0.0
        ox, oy = points[0]
        previous = (mx, my, ux, uy)
        for k in range(len(points)):
            away = (points[k, 0] - previous[0]) * previous[3] - (points[k, 1] - previous[1]) * previous[2]
            if abs(away) > limit:
                continue
            x, y = points[k, 0] - ox, points[k, 1] - oy
            n += 1
            sx, sy = sx + x, sy + y
            sxx, sxy, syy = sxx + x * x, sxy + x * y, syy + y * y
        if n < FEWEST:
            break
        mx, my = sx / n, sy / n
        sxx, sxy, syy = sxx - n * mx * mx, sxy - n * mx * my, syy - n * my * my
        mx, my = mx + ox, my + oy
        angle = 0.5 * np.arctan2(2.0 * sxy, sxx - syy)
        ux, uy = np.cos(angle), np.sin(angle)
        variance = max(sxx * uy * uy - 2.0 * sxy * ux * uy + syy * ux * ux, 0.0) / max(n - 2, 1)
        limit = OUTLIER * np.sqrt(variance) + 1e-9
    ends = (points[-1, 0] - points[0, 0]) * ux + (points[-1, 1] - points[0, 1]) * uy
    line[0], line[1], line[2], line[3], line[4], line[5], line[6] = mx, my, ux, uy, abs(ends), variance, n


@njit
def _meet(first: Floats, second: Floats, ray: Floats) -> bool:
    """Write where two lines meet; False when they hardly do."""
    cross = first[2] * second[3] - first[3] * second[2]
    if abs(cross) < 0.05:
        return False
    x, y = second[0] - first[0], second[1] - first[1]
    share = (x * second[3] - y * second[2]) / cross
    ray[0], ray[1] = first[0] + share * first[2], first[1] + share * first[3]
    return True


@njit
def _summarise(lines: Floats, rays: Floats, f: float, covariances: Floats) -> None:
    """Write the corners' covariances: n . dc is each line's error at the corner."""
    for side in range(4):
        first, second = lines[side - 1], lines[side]
        cross = first[2] * second[3] - first[3] * second[2]
        v, w = _variance_at(first, rays[side], f), _variance_at(second, rays[side], f)
        # c = a u1 + b u2 with a = -e2 / cross, b = e1 / cross, where e_i is the error along the normal (u_y, -u_x)
        for i in range(2):
            for j in range(2):
                covariances[side, i, j] = (w * first[2 + i] * first[2 + j] + v * second[2 + i] * second[2 + j]) / (cross * cross)


@njit
def _variance_at(line: Floats, ray: Floats, f: float) -> float:
    """Variance of a line's place at a ray [px^2]."""
    along = (ray[0] - line[0]) * line[2] + (ray[1] - line[1]) * line[3]
    lever = 12.0 * (along / max(line[4], 1e-12)) ** 2
    independent = max(f * line[4] / CORRELATED, 2.0)
    return (f * f * line[5] / min(independent, line[6]) + line[8] ** 2) * (1.0 + lever) + FLOOR * FLOOR
