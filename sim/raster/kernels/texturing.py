"""Colours along a run of pixels that see one face: its texture, averaged over each pixel's footprint.

Prints are integrated exactly over an upright rectangle as large as the footprint, by summed areas (Crow, "Summed-area tables for texture
mapping", 1984): their edges are where they should be to a hundredth of a pixel, however near or far. Repeating textures are looked up in
their pyramid (Williams, "Pyramidal parametrics", 1983).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.raster.kernels.faces import S, Singles, T, W
from sim.raster.kernels.views import Floats
from slam.kernels.jit import njit

Places = NDArray[np.int64]
Room = tuple[Singles, NDArray[np.int32]]
"""Room (4, W) and (2, W) for what is known of each pixel of a run."""

STRIDE = 16
"""Pixels that share a level of the pyramid."""
BITS = 8
"""Of the fraction of a place on a texture."""
ONE, PART = 1 << BITS, np.float32(1.0 / (1 << BITS))
ROUNDING = 2.0
"""Levels of the pyramid change midway between two powers of two: where the square of a footprint is this."""
LEAST = 1e-6
"""Smallest side of a rectangle [cells]."""
WHITE = 1.0 / 255.0


@njit
def paint_sky(x: Singles, y: Singles, R: Floats, sky: Singles, room: Room, out: Singles) -> None:
    """Colours (N, 3) of the sky: `sky` (2, 3) has those overhead and at the horizon."""
    rx, ry, r1 = np.float32(R[0, 2]), np.float32(R[1, 2]), np.float32(R[2, 2])
    one, zero, ups = np.float32(1.0), np.float32(0.0), room[0][0]
    red, green, blue = sky[1, 0], sky[1, 1], sky[1, 2]
    more_red, more_green, more_blue = sky[0, 0] - red, sky[0, 1] - green, sky[0, 2] - blue
    for i in range(len(x)):
        u, v = x[i], y[i]
        ups[i] = min(max((rx * u + ry * v + r1) / np.sqrt(u * u + v * v + one), zero), one)
    for i in range(len(x)):
        up = ups[i]
        out[i, 0], out[i, 1], out[i, 2] = red + up * more_red, green + up * more_green, blue + up * more_blue


@njit
def paint_texture(
    x: Singles, y: Singles, c: Floats, step: float, pyramid: Singles, texels: float, size: int, own: Singles, room: Room, out: Singles
) -> None:
    """Colours (N, 3) of a face of colour `own` (3,) and a repeating texture.

    Args:
        x: (N,) of the rays at z = 1.
        y: (N,)
        c: the face's coefficients.
        step: of the rays from pixel to pixel.
        pyramid: all levels of the texture, the finest of size x size texels first.
        texels: to a metre.
        size: of the finest level.
        own: what the texture's brightness is multiplied with.
        room: see `Room`.
        out: (N, 3).
    """
    places, count = room[1], len(x)
    per_pixel = (step * texels) ** 2 / ROUNDING
    widest = _widest(c, x[0], y[0]) * per_pixel
    for start in range(0, count, STRIDE):
        end, before = min(start + STRIDE, count), widest
        widest = _widest(c, x[end - 1], y[end - 1]) * per_pixel if count > 1 else widest
        side, finer, most_texels = size, 0, max(widest, before)
        while most_texels > 1.0 and side > 4:
            finer += side * side
            side >>= 1
            most_texels *= 0.25
        _find_places(x, y, c, texels * side / size, (start, end), places)
        _look_up(pyramid, (finer, side), (start, end), places, own, out)


@njit
def _find_places(x: Singles, y: Singles, c: Floats, texels: float, run: tuple[int, int], places: NDArray[np.int32]) -> None:
    """Fill the places [1 / ONE texels] from the middle of the first texel on, of pixels that see a texture."""
    wx, wy, w1, scale = np.float32(c[W]), np.float32(c[W + 1]), np.float32(c[W + 2]), texels * ONE
    sx, sy, s1 = np.float32(c[S] * scale), np.float32(c[S + 1] * scale), np.float32(c[S + 2] * scale)
    tx, ty, t1 = np.float32(c[T] * scale), np.float32(c[T + 1] * scale), np.float32(c[T + 2] * scale)
    one, half = np.float32(1.0), np.float32(0.5 * ONE)
    for i in range(np.uint64(run[0]), np.uint64(run[1])):
        u, v = x[i], y[i]
        depth = one / (wx * u + wy * v + w1)
        places[0, i] = np.int32((sx * u + sy * v + s1) * depth - half)
        places[1, i] = np.int32((tx * u + ty * v + t1) * depth - half)


@njit
def _look_up(pyramid: Singles, level: tuple[int, int], run: tuple[int, int], places: NDArray[np.int32], own: Singles, out: Singles) -> None:
    """Fill colours, `own` times the brightness at places on a level, which begins at a texel and has a side, of four texels each."""
    first, side, mask = np.uint64(level[0]), np.uint64(level[1]), np.int64(level[1] - 1)
    red, green, blue, most = own[0], own[1], own[2], np.float32(255.0)
    for i in range(np.uint64(run[0]), np.uint64(run[1])):
        s, t = np.int64(places[0, i]), np.int64(places[1, i])
        a, b = np.float32(s & (ONE - 1)) * PART, np.float32(t & (ONE - 1)) * PART
        left, right = np.uint64((s >> BITS) & mask), np.uint64(((s >> BITS) + 1) & mask)
        top, bottom = first + np.uint64((t >> BITS) & mask) * side, first + np.uint64(((t >> BITS) + 1) & mask) * side
        p, q = pyramid[top + left], pyramid[bottom + left]
        p += (pyramid[top + right] - p) * a
        q += (pyramid[bottom + right] - q) * a
        shade = p + (q - p) * b
        out[i, 0], out[i, 1], out[i, 2] = min(red * shade, most), min(green * shade, most), min(blue * shade, most)


@njit
def _widest(c: Floats, u: float, v: float) -> float:
    """Square of the longer side of a pixel's footprint, for rays a distance of 1 apart."""
    depth = 1.0 / (c[W] * u + c[W + 1] * v + c[W + 2])
    s, t = (c[S] * u + c[S + 1] * v + c[S + 2]) * depth, (c[T] * u + c[T + 1] * v + c[T + 2]) * depth
    sx, sy, tx, ty = c[S] - s * c[W], c[S + 1] - s * c[W + 1], c[T] - t * c[W], c[T + 1] - t * c[W + 1]
    return max(sx * sx + sy * sy, tx * tx + ty * ty) * depth * depth


@njit
def paint_print(
    x: Singles, y: Singles, c: Floats, step: float, sums: Floats, place: Places, own: Singles, room: Room, out: Singles
) -> None:
    """Colours (N, 3) of a print in the light `own` (3,).

    Args:
        x: (N,) of the rays at z = 1.
        y: (N,)
        c: the face's coefficients.
        step: of the rays from pixel to pixel.
        sums: (S, 3) summed areas of all prints.
        place: (4,) first row among the sums, height and width [cells] of this print, and 1 if it is grey, else 3.
        own: colour of white paper in this light, above 0.
        room: see `Room`.
        out: (N, 3).
    """
    first, height, width, channels, sides = place[0], place[1], place[2], place[3], room[0]
    _find_footprints(x, y, c, step, sides)
    for i in range(np.uint64(len(x))):
        s, t, across, along = float(sides[0, i]), float(sides[1, i]), float(sides[2, i]), float(sides[3, i])
        left, right = min(max(s - across, 0.0), width - 2 * LEAST), min(max(s + across, LEAST), width - LEAST)
        top, bottom = min(max(t - along, 0.0), height - 2 * LEAST), min(max(t + along, LEAST), height - LEAST)
        a, b = int(left), int(top)
        if a == int(right) and b == int(bottom):  # within one cell
            at = np.uint64(first + b * (width + 1) + a)
            below = at + np.uint64(width + 1)
            for k in range(np.uint64(channels)):
                cell = sums[at, k] - sums[at + np.uint64(1), k] - sums[below, k] + sums[below + np.uint64(1), k]
                out[i, k] = own[k] * cell * WHITE
        else:
            weight = WHITE / ((right - left) * (bottom - top))
            for k in range(channels):
                whole = _sum(sums, first, width, right, bottom, k) - _sum(sums, first, width, left, bottom, k)
                whole -= _sum(sums, first, width, right, top, k) - _sum(sums, first, width, left, top, k)
                out[i, np.uint64(k)] = own[k] * min(max(whole * weight, 0.0), 1.0)
        if channels == 1:
            out[i, 1], out[i, 2] = out[i, 0] * own[1] / own[0], out[i, 0] * own[2] / own[0]


@njit
def _find_footprints(x: Singles, y: Singles, c: Floats, step: float, sides: Singles) -> None:
    """Fill where on its texture each pixel sees a face, and half of how wide its footprint is along both axes."""
    wx, wy, w1 = np.float32(c[W]), np.float32(c[W + 1]), np.float32(c[W + 2])
    sx, sy, s1 = np.float32(c[S]), np.float32(c[S + 1]), np.float32(c[S + 2])
    tx, ty, t1 = np.float32(c[T]), np.float32(c[T + 1]), np.float32(c[T + 2])
    one, half = np.float32(1.0), np.float32(0.5 * step)
    for i in range(len(x)):
        u, v = x[i], y[i]
        depth = one / (wx * u + wy * v + w1)
        s, t = (sx * u + sy * v + s1) * depth, (tx * u + ty * v + t1) * depth
        su, sv, tu, tv = sx - s * wx, sy - s * wy, tx - t * wx, ty - t * wy
        sides[0, i], sides[1, i] = s, t
        sides[2, i], sides[3, i] = np.sqrt(su * su + sv * sv) * abs(depth) * half, np.sqrt(tu * tu + tv * tv) * abs(depth) * half


@njit
def _sum(sums: Floats, first: int, width: int, s: float, t: float, channel: int) -> float:
    """Sum over the cells from the top left to (s, t), which is inside."""
    column, row, k = int(s), int(t), np.uint64(channel)
    a, b = s - column, t - row
    at = np.uint64(first + row * (width + 1) + column)
    below, one = at + np.uint64(width + 1), np.uint64(1)
    top = sums[at, k] + (sums[at + one, k] - sums[at, k]) * a
    bottom = sums[below, k] + (sums[below + one, k] - sums[below, k]) * a
    return top + (bottom - top) * b
