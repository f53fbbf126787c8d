"""The beams of a sweep as a fan: sorted by bearing, so that those that look towards something are found at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import inlined, njit

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Singles = NDArray[np.float32]
Place = tuple[float, float]
Fan = tuple[Ints, Ints, Floats, Floats]
"""First beam of each bin of bearings (BINS + 1,), number of each sorted beam (N,), the sorted beams' origins and directions (6, N), and
their extent: x, y [m] of the middle, how far [m] an origin is from there at most, lowest and highest z [m] within reach."""
Beams = tuple[tuple[int, int], tuple[int, int]]
"""Two stretches of sorted beams, each from the first to the one after the last."""

BINS = 1024
"""Of bearings."""
MARGIN = 1e-6
"""Beams that pass a solid by so much are tried [m]."""
WIDEST = np.pi / np.sqrt(2.0)
"""The tangent to a circle of radius r is off the bearing of its middle (x, y) by no more than so many r / (|x| + |y|): a bearing never
grows faster than its angle, and asin(s) not faster than s pi / 2."""


@njit
def fan_of(origins: Singles, directions: Singles, reach: float) -> Fan:
    """Beams of origins (N, 3) and unit directions (N, 3), sorted by bearing; fast for those of a sweep."""
    count = len(origins)
    rays, bearings = np.empty((6, count)), np.empty(count)
    for i in range(count):
        for j in range(3):
            rays[j, i], rays[3 + j, i] = origins[i, j], directions[i, j]
    for i in range(count):
        bearings[i] = bearing(rays[3, i], rays[4, i])
    order = np.arange(count)
    if not _rises(bearings):
        order = _sorted(bearings)
        rays, bearings = rays[:, order], bearings[order]
    starts, k = np.empty(BINS + 1, np.int64), 0
    for i in range(count):
        last = min(int(bearings[i] * (0.25 * BINS)), BINS - 1)
        while k <= last:
            starts[k] = i
            k += 1
    starts[k:] = count
    return starts, order, rays, _extent(rays, reach)


@inlined
def _rises(bearings: Floats) -> bool:
    """Whether the bearings (N,) never fall."""
    falls = False
    for i in range(1, len(bearings)):
        falls |= bearings[i] < bearings[i - 1]
    return not falls


@inlined
def _sorted(bearings: Floats) -> Ints:
    """Order (N,) in which bearings, two at least, rise; those of a sweep rise or fall, with one jump where a turn is full."""
    count, jump, jumps = len(bearings), 0, 0
    step = bearings[1] - bearings[0]
    sign = 1.0 if 0.0 <= step < 2.0 or step < -2.0 else -1.0
    for i in range(1, count):
        if sign * (bearings[i] - bearings[i - 1]) < 0.0:
            jump, jumps = i, jumps + 1
    if jumps > 1 or (jumps == 1 and sign * (bearings[0] - bearings[-1]) < 0.0):
        return np.argsort(bearings)
    order = np.empty(count, np.int64)
    for i in range(count):
        k = i + jump if sign > 0.0 else count - 1 - i + jump
        order[i] = k - count if k >= count else k
    return order


@inlined
def _extent(rays: Floats, reach: float) -> Floats:
    """The last of a `Fan`."""
    count = rays.shape[1]
    extent = np.array([0.0, 0.0, 0.0, np.inf, -np.inf])
    if count == 0:
        return extent
    x, y = rays[0, count // 2], rays[1, count // 2]
    off, low, high = 0.0, np.inf, -np.inf
    for i in range(count):
        ox, oy, z = rays[0, i] - x, rays[1, i] - y, rays[2, i]
        end, away = z + reach * rays[5, i], ox * ox + oy * oy
        off = away if away > off else off
        z, end = (z, end) if z < end else (end, z)
        low, high = z if z < low else low, end if end > high else high
    extent[:] = x, y, np.sqrt(off) + MARGIN, low, high
    return extent


@inlined
def beams_towards(fan: Fan, a: Place, b: Place, margin: float) -> Beams:
    """Beams that may pass within `margin` [m] of a segment from `a` to `b`, as seen from the middle of the fan."""
    right, left = (a, b) if a[0] * b[1] - a[1] * b[0] > 0.0 else (b, a)
    over_right, over_left = 1.0 / max(abs(right[0]) + abs(right[1]), 1e-30), 1.0 / max(abs(left[0]) + abs(left[1]), 1e-30)
    low, high = _bearing(right, over_right), _bearing(left, over_left)
    span = high - low if high >= low else high - low + 4.0
    wider_right, wider_left = WIDEST * margin * over_right, WIDEST * margin * over_left
    low, high = low - wider_right, high + wider_left
    ex, ey = b[0] - a[0], b[1] - a[1]
    near = abs(a[0] * ey - a[1] * ex) <= 1.001 * margin * (abs(ex) + abs(ey)) + 1e-12
    if span + wider_right + wider_left >= 4.0 or (near and _passes(a, b, margin)):
        return (0, fan[0][BINS]), (0, 0)
    return _between(fan[0], low + 4.0 if low < 0.0 else low, high - 4.0 if high > 4.0 else high)


@inlined
def beams_about(fan: Fan, place: Place, radius: float) -> Beams:
    """Beams that may meet a circle about a place [m], as seen from the middle of the fan."""
    if place[0] ** 2 + place[1] ** 2 <= 1.001 * radius * radius + 1e-12:
        return (0, fan[0][BINS]), (0, 0)
    return _between(fan[0], _tangent(place, -radius), _tangent(place, radius))


@inlined
def _passes(a: Place, b: Place, margin: float) -> bool:
    """Whether a segment comes within `margin` [m] of the origin."""
    ex, ey = b[0] - a[0], b[1] - a[1]
    f = min(max(-(a[0] * ex + a[1] * ey) / max(ex * ex + ey * ey, 1e-30), 0.0), 1.0)
    return (a[0] + f * ex) ** 2 + (a[1] + f * ey) ** 2 <= 1.001 * margin * margin + 1e-12


@inlined
def _between(starts: Ints, low: float, high: float) -> Beams:
    """Beams in the bins from one bearing to the other."""
    first, last = min(int(low * (0.25 * BINS)), BINS - 1), min(int(high * (0.25 * BINS)), BINS - 1)
    if low <= high:
        return (starts[first], starts[last + 1]), (0, 0)
    return (starts[first], starts[BINS]), (0, min(starts[last + 1], starts[first]))


@inlined
def _tangent(place: Place, margin: float) -> float:
    """Bearing of the tangent from the origin to a circle about a place: its left one, or with a margin below 0 its right one."""
    distance = np.sqrt(place[0] * place[0] + place[1] * place[1])
    s = min(max(margin / distance, -1.0), 1.0)
    c = np.sqrt(1.0 - s * s)
    return bearing(place[0] * c - place[1] * s, place[0] * s + place[1] * c)


@inlined
def bearing(x: float, y: float) -> float:
    """0..4, grows with the direction of (x, y): one for each quadrant."""
    return _bearing((x, y), 1.0 / max(abs(x) + abs(y), 1e-30))


@inlined
def _bearing(place: Place, over: float) -> float:
    """As `bearing`; `over` is one over the sum of the coordinates' sizes."""
    share = place[1] * over
    return 1.0 + share if place[0] >= 0.0 else 3.0 - share
