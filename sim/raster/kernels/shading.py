"""The colour of each pixel: that of the face it sees, and at edges the mean of all faces that share the pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.raster.kernels.faces import COUNT, DISTANCE, EDGES, LIFT, Ids, Shapes, Singles, W, shape_of, texture_of
from sim.raster.kernels.texturing import Places, paint_print, paint_sky, paint_texture
from sim.raster.kernels.views import Floats, Views
from sim.raster.kernels.visibility import Rays
from slam.kernels.jit import njit

Looks = tuple[Singles, Ids, Floats, Ids]
"""Colours (F, 3) in the light of now, textures (F,), 0: none, mappings (F, 2, 4) and groups (F,): see `sim.surfaces.Faces`."""
Textures = tuple[Singles, float, int]
"""Pyramids (T, texels) of the repeating textures, texels a metre, and texels along a side."""
Prints = tuple[Floats, Places]
"""Summed areas (S, 3) of all prints, and of each the first row, height, width and channels (P, 4)."""
Shares = tuple[Singles, Singles, Ids]
"""Weights of the faces in a pixel, and room for the depth and the face of each of its samples."""
Scene = tuple[Shapes, Looks, Textures, Prints, Singles]
"""Faces, their looks, textures, prints, and the colours (2, 3) of the sky overhead and at the horizon."""

SAMPLES = np.array([[-7, -5, -3, -1, 1, 3, 5, 7], [-3, 5, -7, 1, -5, 7, -1, 3]], np.float32) / np.float32(16.0)
"""Places in a pixel at which the faces of an edge are looked for: no two in one row or column."""
SAMPLE_COUNT = SAMPLES.shape[1]
SHARE = np.float32(1.0 / SAMPLE_COUNT)
MOST_FACES = 6
"""Looked at in one pixel, the sky among them."""


@njit
def shade(ids: Ids, scene: Scene, views: Views, rays: Rays, step: float, picture: Singles) -> None:
    """Fill colours (H, W, 3), 0 to 255, of what `see` found.

    Args:
        ids: (H, W) from `see`.
        scene: the same faces, and how they look.
        views: see `Views`.
        rays: see `Rays`.
        step: of the rays from pixel to pixel.
        picture: (H, W, 3).
    """
    # Everything is taken out of its tuple here, once: taken out in the loop, each array costs as much as a pixel.
    (corners, planes, bodies, lifts), (colours, textures, mappings, groups), (pyramids, texels, size), (sums, places), sky = scene
    (R, o), (x, y, _) = views, rays
    height, width = ids.shape
    ready, coefficients = np.full(len(corners), -1, np.int64), np.empty((len(corners), COUNT))
    changes, found, colour = np.empty(width, np.bool_), np.empty(MOST_FACES, np.int64), np.empty((1, 3), np.float32)
    weights = np.empty(MOST_FACES, np.float32)
    shares = weights, np.empty(SAMPLE_COUNT, np.float32), np.empty(SAMPLE_COUNT, np.int32)
    room = np.empty((4, width), np.float32), np.empty((2, width), np.int32)
    for row in range(height):
        k = min(row, R.shape[1] - 1)
        begin = 0
        while begin < width:
            face, end = ids[row, begin], begin + 1
            while end < width and ids[row, end] == face:
                end += 1
            u, v, out = x[row, begin:end], y[row, begin:end], picture[row, begin:end]
            if face < 0:
                paint_sky(u, v, R[0, k], sky, room, out)
            elif textures[face] == 0:
                _fill(colours[face], out)
            else:
                if ready[face] != k:
                    body, ready[face] = bodies[face], k
                    shape_of(corners[face], planes[face], R[body, k], o[body, k], coefficients[face])
                    texture_of(mappings[face], R[body, k], o[body, k], coefficients[face])
                    coefficients[face, LIFT] = lifts[face]
                if textures[face] < 0:
                    paint_print(u, v, coefficients[face], step, sums, places[-1 - textures[face]], colours[face], room, out)
                else:
                    paint_texture(u, v, coefficients[face], step, pyramids[textures[face]], texels, size, colours[face], room, out)
            begin = end
        _mark_changes(ids, row, changes)
        for column in range(width):
            if not (changes[column] and _is_edge(ids, groups, row, column)):
                continue
            count = _neighbours(ids, row, column, found)
            for i in range(count - 1):
                face = found[i]
                if ready[face] != k:
                    body, ready[face] = bodies[face], k
                    shape_of(corners[face], planes[face], R[body, k], o[body, k], coefficients[face])
                    texture_of(mappings[face], R[body, k], o[body, k], coefficients[face])
                    coefficients[face, LIFT] = lifts[face]
            if _is_alone(ids[row, column], found, count, coefficients, x[row, column], y[row, column], 0.5 * step):
                continue
            _share_out(found, count, coefficients, x[row, column], y[row, column], step, shares)
            own, kept = ids[row, column], np.float32(0.0)
            for i in range(count):
                kept += weights[i] if found[i] == own else np.float32(0.0)
            u, v, out = x[row, column : column + 1], y[row, column : column + 1], picture[row, column]
            for channel in range(3):
                out[channel] *= kept
            for i in range(count):
                face = found[i]
                if weights[i] == 0.0 or face == own:
                    continue
                if face < 0:
                    paint_sky(u, v, R[0, k], sky, room, colour)
                elif textures[face] == 0:
                    colour[0] = colours[face]
                elif textures[face] < 0:
                    paint_print(u, v, coefficients[face], step, sums, places[-1 - textures[face]], colours[face], room, colour)
                else:
                    paint_texture(u, v, coefficients[face], step, pyramids[textures[face]], texels, size, colours[face], room, colour)
                for channel in range(3):
                    out[channel] += weights[i] * colour[0, channel]


@njit
def _fill(own: Singles, out: Singles) -> None:
    red, green, blue = own[0], own[1], own[2]
    for i in range(len(out)):
        out[i, 0], out[i, 1], out[i, 2] = red, green, blue


@njit
def _mark_changes(ids: Ids, row: int, changes: NDArray[np.bool_]) -> None:
    """Which pixels of a row (W,) have a neighbour that sees another face."""
    own, above, below = ids[row], ids[max(row - 1, 0)], ids[min(row + 1, len(ids) - 1)]
    one = np.uint64(1)
    for column in range(len(own)):
        changes[column] = (own[column] != above[column]) | (own[column] != below[column])
    for column in range(np.uint64(len(own) - 1)):
        changes[column] |= own[column] != own[column + one]
    for column in range(one, np.uint64(len(own))):
        changes[column] |= own[column] != own[column - one]


@njit
def _is_edge(ids: Ids, groups: Ids, row: int, column: int) -> bool:
    """Whether a pixel has a neighbour that sees another surface."""
    height, width = ids.shape
    face = ids[row, column]
    for r, c in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
        other = ids[min(max(r, 0), height - 1), min(max(c, 0), width - 1)]
        if other != face and (other < 0 or face < 0 or groups[other] != groups[face]):
            return True
    return False


@njit
def _neighbours(ids: Ids, row: int, column: int, found: Places) -> int:
    """Faces that a pixel and those round it see, then what is seen where they are not: the sky, or the pixel's own face; how many."""
    height, width = ids.shape
    count, behind = 0, ids[row, column]
    for r in range(max(row - 1, 0), min(row + 2, height)):
        for c in range(max(column - 1, 0), min(column + 2, width)):
            face = ids[r, c]
            behind = min(behind, face) if face < 0 else behind
            known = face < 0 or count == MOST_FACES - 1
            for i in range(count):
                known |= found[i] == face
            if not known:
                found[count] = face
                count += 1
    found[count] = behind
    return count + 1


@njit
def _is_alone(own: int, found: Places, count: int, coefficients: Floats, x: float, y: float, half: float) -> bool:
    """Whether the face that a pixel's middle sees fills the whole pixel, whose sides are two halves long."""
    farthest = 0.0
    if own >= 0:
        c = coefficients[own]
        for e in range(EDGES, EDGES + 12, 3):
            if c[e] * x + c[e + 1] * y + c[e + 2] < (abs(c[e]) + abs(c[e + 1])) * half:
                return False
        farthest = (c[W] * x + c[W + 1] * y + c[W + 2] - (abs(c[W]) + abs(c[W + 1])) * half) * c[LIFT]
    for i in range(count - 1):
        if found[i] == own:
            continue
        c, outside = coefficients[found[i]], False
        for e in range(EDGES, EDGES + 12, 3):
            outside |= c[e] * x + c[e + 1] * y + c[e + 2] < -(abs(c[e]) + abs(c[e + 1])) * half
        nearest = (c[W] * x + c[W + 1] * y + c[W + 2] + (abs(c[W]) + abs(c[W + 1])) * half) * c[LIFT]
        if not outside and c[DISTANCE] < 0.0 and nearest > farthest:
            return False
    return True


@njit
def _share_out(found: Places, count: int, coefficients: Floats, x: float, y: float, step: float, shares: Shares) -> None:
    """How much of a pixel each of the found faces has; the last has what is left."""
    weights, nearest, best = shares
    weights[:count] = 0.0
    nearest[:] = 0.0
    best[:] = count - 1
    for i in range(count - 1):
        c = coefficients[found[i]]
        if c[DISTANCE] < 0.0:
            w, wu, wv = _across(c, W, x, y, step)
            a, au, av = _across(c, EDGES, x, y, step)
            b, bu, bv = _across(c, EDGES + 3, x, y, step)
            e, eu, ev = _across(c, EDGES + 6, x, y, step)
            f, fu, fv = _across(c, EDGES + 9, x, y, step)
            lift, index, zero = np.float32(c[LIFT]), np.int32(i), np.float32(0.0)
            for s in range(np.uint64(SAMPLE_COUNT)):
                u, v = SAMPLES[0, s], SAMPLES[1, s]
                near = (w + wu * u + wv * v) * lift
                inside = (a + au * u + av * v >= zero) & (b + bu * u + bv * v >= zero) & (near > nearest[s])
                inside &= (e + eu * u + ev * v >= zero) & (f + fu * u + fv * v >= zero)
                nearest[s] = near if inside else nearest[s]
                best[s] = index if inside else best[s]
    for s in range(np.uint64(SAMPLE_COUNT)):
        weights[np.uint64(best[s])] += SHARE


@njit
def _across(c: Floats, first: int, x: float, y: float, step: float) -> tuple[np.float32, np.float32, np.float32]:
    """What is linear in a pixel's ray, in its middle, and its growth from pixel to pixel across and down."""
    return np.float32(c[first] * x + c[first + 1] * y + c[first + 2]), np.float32(c[first] * step), np.float32(c[first + 1] * step)
