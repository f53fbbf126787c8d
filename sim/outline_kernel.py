"""Beams against what stands upright, drawn into a polar grid; and the distance from outlines.

As a depth buffer does with pixels, but in one dimension: the beams are sorted by bearing, and every outline is drawn over those beams
alone that look its way.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.fan_kernel import Fan, beams_about, beams_towards, fan_of
from sim.lidar_kernel import Codes, Met
from slam.kernels.jit import inlined, njit

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Singles = NDArray[np.float32]
Drawn = tuple[Floats, Ints]
"""Of each sorted beam: the nearest hit [m], and the number of what it hit."""
Shape = tuple[Floats, Floats]
"""Sides of a solid (K, 4), and its place (5,), see `Outlines`."""
Outlines = tuple[Floats, Floats, Ints, Ints, Floats, Codes]
"""Upright solids. Sides (M, 4) as x0 y0 x1 y1 [m], counter-clockwise; of a round solid one row, x y of the middle and the radius.
Unit normals of the sides (M, 2), whose solids they are (M,). First and last side, and 1 for a round solid (S, 3); x, y [m], radius [m]
about it, lowest and highest z [m] (S, 5); material (S,)."""

SLACK = 1e-9
"""Sides are this much longer at both ends than they are, as a share: no beam slips through where two of them meet."""


@njit
def meet(outlines: Outlines, origins: Singles, directions: Singles, reach: float) -> Met:
    """What beams of origins (N, 3) and unit directions (N, 3) meet within `reach` [m]."""
    sides, normals, spans, places = outlines[0], outlines[1], outlines[3], outlines[4]
    fan = fan_of(origins, directions, reach)
    x, y, width, low, high = fan[3]
    drawn = np.full(len(origins), reach), np.full(len(origins), -1, np.int64)
    for s in range(len(spans)):
        px, py, far = places[s, 0] - x, places[s, 1] - y, reach + width + places[s, 2]
        if px * px + py * py > far * far or places[s, 3] > high or places[s, 4] < low:
            continue
        shape = sides[spans[s, 0] : spans[s, 1]], places[s]
        if spans[s, 2]:
            _draw_round(fan, drawn, spans[s, 0], places[s])
        else:
            _draw_sides(fan, drawn, (spans[s, 0], normals[spans[s, 0] : spans[s, 1]]), shape)
        for face in (places[s, 3], places[s, 4]):
            if low < face < high:
                _draw_level(fan, drawn, -2 - s, shape if not spans[s, 2] else (sides[:0], places[s]), face)
    return _found(outlines, fan, drawn)


@inlined
def _draw_sides(fan: Fan, drawn: Drawn, known: tuple[int, Floats], shape: Shape) -> None:
    """Draw the sides of one solid, of which the first one's number and the normals are known; from outside, those that face the beams."""
    (first, normals), (sides, place) = known, shape
    x, y, width = fan[3][0], fan[3][1], fan[3][2]
    outside = False
    for k in range(len(sides)):
        outside = outside or normals[k, 0] * (x - sides[k, 0]) + normals[k, 1] * (y - sides[k, 1]) > width
    for k in range(len(sides)):
        if not outside or normals[k, 0] * (x - sides[k, 0]) + normals[k, 1] * (y - sides[k, 1]) >= -width:
            for beams in beams_towards(fan, (sides[k, 0] - x, sides[k, 1] - y), (sides[k, 2] - x, sides[k, 3] - y), width):
                _draw_side(fan, drawn, first + k, (sides[k], place), beams)


@inlined
def _draw_side(fan: Fan, drawn: Drawn, number: int, shape: Shape, beams: tuple[int, int]) -> None:
    """Draw one side over some beams. Without a branch, so that the compiler takes several beams at once."""
    ox, oy, oz, dx, dy, dz = fan[2][0], fan[2][1], fan[2][2], fan[2][3], fan[2][4], fan[2][5]
    (nearest, hits), (side, place) = drawn, shape
    ax, ay, ex, ey = side[0], side[1], side[2] - side[0], side[3] - side[1]
    low, high = place[3], place[4]
    for k in range(beams[0], beams[1]):
        wx, wy = ax - ox[k], ay - oy[k]
        over = 1.0 / (dx[k] * ey - dy[k] * ex)
        t, u = (wx * ey - wy * ex) * over, (wx * dy[k] - wy * dx[k]) * over
        z = oz[k] + t * dz[k]
        met = (t >= 0.0) & (t < nearest[k]) & (u >= -SLACK) & (u <= 1.0 + SLACK) & (z >= low) & (z <= high)
        nearest[k] = t if met else nearest[k]
        hits[k] = number if met else hits[k]


@inlined
def _draw_round(fan: Fan, drawn: Drawn, number: int, place: Floats) -> None:
    """Draw the side of an upright cylinder."""
    ox, oy, oz, dx, dy, dz = fan[2][0], fan[2][1], fan[2][2], fan[2][3], fan[2][4], fan[2][5]
    nearest, hits = drawn
    middle = place[0] - fan[3][0], place[1] - fan[3][1]
    for begin, end in beams_about(fan, middle, place[2] + fan[3][2]):
        for k in range(begin, end):
            wx, wy = ox[k] - place[0], oy[k] - place[1]
            a, b, c = dx[k] * dx[k] + dy[k] * dy[k], wx * dx[k] + wy * dy[k], wx * wx + wy * wy - place[2] * place[2]
            root = np.sqrt(b * b - a * c)
            t = (-b - root if c > 0.0 else root - b) / a
            z = oz[k] + t * dz[k]
            if 0.0 <= t < nearest[k] and place[3] <= z <= place[4]:
                nearest[k], hits[k] = t, number


@inlined
def _draw_level(fan: Fan, drawn: Drawn, number: int, shape: Shape, face: float) -> None:
    """Draw the top or the bottom of a solid, at height `face` [m]; one without sides is round."""
    rays, (nearest, hits), (sides, place) = fan[2], drawn, shape
    middle = place[0] - fan[3][0], place[1] - fan[3][1]
    for begin, end in beams_about(fan, middle, place[2] + fan[3][2]):
        for k in range(begin, end):
            t = (face - rays[2, k]) / rays[5, k]
            if not 0.0 <= t < nearest[k]:
                continue
            x, y = rays[0, k] + t * rays[3, k], rays[1, k] + t * rays[4, k]
            inside = (x - place[0]) ** 2 + (y - place[1]) ** 2 <= place[2] ** 2
            for s in range(len(sides)):
                inside = inside and _beyond(sides[s], x, y) <= 0.0
            if inside:
                nearest[k], hits[k] = t, number


@inlined
def _found(outlines: Outlines, fan: Fan, drawn: Drawn) -> Met:
    """What was drawn nearest over each beam, in the beams' own order."""
    sides, normals, owners, spans, _, materials = outlines
    order, rays = fan[1], fan[2]
    nearest, hits = drawn
    ranges, cosines, codes = np.full(len(order), np.inf, np.float32), np.ones(len(order), np.float32), np.zeros(len(order), np.int8)
    for k in range(len(order)):
        i, hit = order[k], hits[k]
        if hit == -1:
            continue
        ranges[i] = nearest[k]
        if hit < -1:
            cosines[i], codes[i] = min(abs(rays[5, k]), 1.0), materials[-2 - hit]
            continue
        codes[i] = materials[owners[hit]]
        nx, ny = normals[hit, 0], normals[hit, 1]
        if spans[owners[hit], 2]:
            nx = (rays[0, k] + nearest[k] * rays[3, k] - sides[hit, 0]) / sides[hit, 2]
            ny = (rays[1, k] + nearest[k] * rays[4, k] - sides[hit, 1]) / sides[hit, 2]
        cosines[i] = min(abs(rays[3, k] * nx + rays[4, k] * ny), 1.0)
    return ranges, cosines, codes


@inlined
def _beyond(side: Floats, x: float, y: float) -> float:
    """How far a place is outside of the line of a side [m]."""
    ex, ey = side[2] - side[0], side[3] - side[1]
    return ((x - side[0]) * ey - (y - side[1]) * ex) / np.sqrt(ex * ex + ey * ey)


@njit
def clearance(sides: Floats, x: float, y: float) -> float:
    """Distance [m] from a place to the nearest of the sides (N, 4); inf without any."""
    return np.sqrt(_nearest(sides, x, y, np.inf))


@njit
def clearance_of(sides: Floats, hulls: Floats, x: float, y: float) -> float:
    """As `clearance`, of sides in groups: only those that may be near are looked at.

    Args:
        sides: (N, 4) [m].
        hulls: (M, 5) middle and radius [m] of a circle that holds a group, its first side and the one after its last.
        x: of the place [m].
        y: of the place [m].
    """
    nearest = np.inf
    for k in range(len(hulls)):
        wx, wy = hulls[k, 0] - x, hulls[k, 1] - y
        least = np.sqrt(wx * wx + wy * wy) - hulls[k, 2]
        if least <= 0.0 or least * least < nearest:
            nearest = _nearest(sides[int(hulls[k, 3]) : int(hulls[k, 4])], x, y, nearest)
    return np.sqrt(nearest)


@inlined
def _nearest(sides: Floats, x: float, y: float, nearest: float) -> float:
    """Least of the squared distances [m^2] to sides (N, 4), and of what was the nearest."""
    for k in range(len(sides)):
        ex, ey, wx, wy = sides[k, 2] - sides[k, 0], sides[k, 3] - sides[k, 1], x - sides[k, 0], y - sides[k, 1]
        f = min(max((wx * ex + wy * ey) / max(ex * ex + ey * ey, 1e-30), 0.0), 1.0)
        nearest = min(nearest, (wx - f * ex) ** 2 + (wy - f * ey) ** 2)
    return nearest
