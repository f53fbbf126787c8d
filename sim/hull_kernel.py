"""Beams against convex hulls that move while the beams leave one after the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.fan_kernel import Fan, beams_about, fan_of
from sim.lidar_kernel import Codes, Met
from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Singles = NDArray[np.float32]
Vector = tuple[float, float, float]
Hulls = tuple[tuple[Floats, Ints], Floats, Ints, Floats, Codes]
"""In the frames of the bodies: planes of the faces (M, 4), outward unit normal and its product with a point of the plane [m]; first
corner of each face (M + 1,); corners (C, 3) [m]. Body, first and last face of each hull (H, 3). Sphere about each hull: x, y, z, radius
[m], and radius of an upright tube about the frame's origin that cuts it, or inf (H, 5). Material (H,)."""

LIFT = 1e-6
"""Faces count that are by so much higher or lower than the beams come [m]."""


@njit
def meet(hulls: Hulls, frames: Floats, times: tuple[float, float], rays: tuple[Singles, Singles], met: Met, reach: float) -> None:
    """Replace what beams have `met` by hulls where those are nearer.

    Args:
        hulls: see `Hulls`.
        frames: (P, K, 12) of the bodies, see `kernels.frames_of`.
        times: place of the first beam among the frames and from beam to beam.
        rays: origins (N, 3) [m] and unit directions (N, 3) in the world.
        met: changed in place.
        reach: [m]
    """
    fan = fan_of(rays[0], rays[1], reach)
    x, y, width, low, high = fan[3]
    for h in range(len(hulls[2])):
        body, sphere = frames[hulls[2][h, 0]], hulls[3][h]
        ax, ay, az = _moved(body[0], sphere)
        stray, lift = _strays(body, sphere)
        radius, lift = sphere[3] + stray + width, lift + LIFT
        if (ax - x) ** 2 + (ay - y) ** 2 > (reach + radius) ** 2 or az - sphere[3] - lift > high or az + sphere[3] + lift < low:
            continue
        planes = _faces_between(hulls, h, body[0], low - lift, high + lift)
        if len(planes) or np.isfinite(sphere[4]):
            for beams in beams_about(fan, (ax - x, ay - y), radius):
                _draw((planes, sphere, hulls[4][h]), body, times, fan, beams, met)


@njit
def _faces_between(hulls: Hulls, h: int, frame: Floats, low: float, high: float) -> Floats:
    """Planes (F, 4) of the faces that reach a height between two [m]: between these the others cut nothing off.

    A ray from there to the hull enters it through a face that comes between these heights, for the hull is convex.
    """
    planes, firsts, corners = hulls[0][0], hulls[0][1], hulls[1]
    chosen, count = np.empty((hulls[2][h, 2] - hulls[2][h, 1], 4)), 0
    for k in range(hulls[2][h, 1], hulls[2][h, 2]):
        bottom, top = np.inf, -np.inf
        for c in range(firsts[k], firsts[k + 1]):
            z = frame[11] + frame[6] * corners[c, 0] + frame[7] * corners[c, 1] + frame[8] * corners[c, 2]
            bottom, top = min(bottom, z), max(top, z)
        if bottom <= high and top >= low:
            chosen[count] = planes[k]
            count += 1
    return chosen[:count]


@njit
def _draw(hull: tuple[Floats, Floats, int], body: Floats, times: tuple[float, float], fan: Fan, beams: tuple[int, int], met: Met) -> None:
    """Draw one hull of planes, sphere and material over some of the sorted beams."""
    planes, (sx, sy, sz, radius, tube) = hull[0], hull[1]
    order, rays = fan[1], fan[2]
    f = np.empty(12)
    for k in range(beams[0], beams[1]):
        i = order[k]
        place = min(max(times[0] + i * times[1], 0.0), len(body) - 1.0)
        before = min(int(place), len(body) - 2)
        for j in range(12):
            f[j] = body[before, j] + (place - before) * (body[before + 1, j] - body[before, j])
        x, y, z = rays[0, k] - f[9], rays[1, k] - f[10], rays[2, k] - f[11]
        ox, oy, oz = f[0] * x + f[3] * y + f[6] * z, f[1] * x + f[4] * y + f[7] * z, f[2] * x + f[5] * y + f[8] * z
        x, y, z = rays[3, k], rays[4, k], rays[5, k]
        dx, dy, dz = f[0] * x + f[3] * y + f[6] * z, f[1] * x + f[4] * y + f[7] * z, f[2] * x + f[5] * y + f[8] * z
        x, y, z = sx - ox, sy - oy, sz - oz
        along = x * dx + y * dy + z * dz
        half = radius * radius - (x * x + y * y + z * z - along * along)
        if half < 0.0:
            continue
        # where it is in the sphere, so that faces out of reach of the beams cannot be missed
        entry, leave = along - np.sqrt(half), along + np.sqrt(half)
        if leave < 0.0 or entry > met[0][i]:
            continue
        t, cosine = _entry(planes, tube, (ox, oy, oz), (dx, dy, dz))
        if max(entry, 0.0) <= t <= leave and t < met[0][i]:
            met[0][i], met[1][i], met[2][i] = t, cosine, hull[2]


@njit
def _entry(planes: Floats, tube: float, o: Vector, d: Vector) -> tuple[float, float]:
    """Distance at which a ray enters the space below all planes (M, 4) and in the tube, or leaves it if it starts there, and the cosine.

    A distance below 0: never.
    """
    entry, leave, cosine, leaving = -np.inf, np.inf, 1.0, 1.0
    if np.isfinite(tube):
        entry, leave, cosine = _tube_met(tube, o, d)
        leaving = cosine
    for k in range(len(planes)):
        towards = planes[k, 0] * d[0] + planes[k, 1] * d[1] + planes[k, 2] * d[2]
        height = planes[k, 0] * o[0] + planes[k, 1] * o[1] + planes[k, 2] * o[2] - planes[k, 3]
        t = -height / towards
        if towards < 0.0 and t > entry:
            entry, cosine = t, -towards
        elif towards > 0.0 and t < leave:
            leave, leaving = t, towards
        elif towards == 0.0 and height > 0.0:
            leave = -np.inf
        if entry > leave:
            return -1.0, 1.0
    return (entry, min(cosine, 1.0)) if entry >= 0.0 else (leave, min(leaving, 1.0))


@njit
def _tube_met(radius: float, o: Vector, d: Vector) -> tuple[float, float, float]:
    """Distances at which a ray enters and leaves an upright tube, and the cosine; where it misses, it leaves before it enters."""
    a, b = d[0] * d[0] + d[1] * d[1], o[0] * d[0] + o[1] * d[1]
    square = b * b - a * (o[0] * o[0] + o[1] * o[1] - radius * radius)
    if square < 0.0:
        return np.inf, -np.inf, 1.0
    root = np.sqrt(square)
    return (-b - root) / a, (root - b) / a, root / radius


@njit
def _moved(frame: Floats, p: Floats) -> Vector:
    """Where a point of a body is in the world."""
    return (
        frame[9] + frame[0] * p[0] + frame[1] * p[1] + frame[2] * p[2],
        frame[10] + frame[3] * p[0] + frame[4] * p[1] + frame[5] * p[2],
        frame[11] + frame[6] * p[0] + frame[7] * p[1] + frame[8] * p[2],
    )


@njit
def _strays(body: Floats, sphere: Floats) -> tuple[float, float]:
    """How far a body in frames (K, 12) takes the middle of a sphere away from its first place, and any point of it up or down [m]."""
    ax, ay, az = _moved(body[0], sphere)
    stray, lift = 0.0, 0.0
    for k in range(1, len(body)):
        x, y, z = _moved(body[k], sphere)
        turn = (body[k, 6] - body[0, 6]) ** 2 + (body[k, 7] - body[0, 7]) ** 2 + (body[k, 8] - body[0, 8]) ** 2
        stray = max(stray, (x - ax) ** 2 + (y - ay) ** 2)
        lift = max(lift, abs(z - az) + sphere[3] * np.sqrt(turn))
    return np.sqrt(stray), lift
