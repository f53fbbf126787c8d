"""What an image sensor makes of the light: blur while it is exposed, noise, whole numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.raster.kernels.depth import nearness
from sim.raster.kernels.faces import Ids, Shapes, Singles
from sim.raster.kernels.views import Views
from slam.kernels.jit import njit

Whole = NDArray[np.uint8]
Motions = tuple[NDArray[np.bool_], Singles]
"""Which faces' motions are known (F + 1,), and these (F + 1, 3, 3): what a ray is multiplied with to get the motion of what it meets,
over its depth, during the exposure; the last is for no face."""

SHARPEST = 1.0
"""Motion over fewer pixels than this does not show."""
FARTHEST = 40
"""Longest half of a blur [px]."""
STRIDE = 32
"""Pixels of one face that are taken to move alike."""


@njit
def develop(picture: Singles, noise: Singles, offsets: NDArray[np.int64], read_sigma: float, shot: float) -> Whole:
    """Whole numbers (H, W, 3) of colours with noise of variance read_sigma^2 + shot x colour.

    Args:
        picture: (H, W, 3) 0 to 255.
        noise: (N,) of deviation 1; each row takes a stretch of it.
        offsets: (H,) where the stretches begin.
        read_sigma: noise in the dark.
        shot: growth of the variance with the colour.
    """
    height, width, _ = picture.shape
    result = np.empty(picture.shape, np.uint8)
    for row in range(height):
        _develop_row(picture[row].reshape(3 * width), noise[offsets[row] :], (read_sigma, shot), result[row].reshape(3 * width))
    return result


@njit
def develop_blurred(
    picture: Singles,
    scene: tuple[Ids, Shapes, Views],
    rays: tuple[Singles, Singles],
    focal: float,
    grain: tuple[Singles, NDArray[np.int64], float, float],
) -> Whole:
    """The same of the mean colours over the exposure, each along the way that what its pixel sees goes through the picture.

    Args:
        picture: (H, W, 3) in the middle of the exposure.
        scene: faces that are seen (H, W), all faces, and the views at the beginning and the end of the exposure.
        rays: x and y (H, W) of the pixels' rays.
        focal: [px].
        grain: all but the picture of what `develop` takes.
    """
    (ids, shapes, views), (x, y), (noise, offsets, read_sigma, shot) = scene, rays, grain
    height, width, _ = picture.shape
    lights, result, count = picture.reshape(height, 3 * width), np.empty(picture.shape, np.uint8), len(shapes[0])
    motions = np.zeros(count + 1, np.bool_), np.empty((count + 1, 3, 3), np.float32)
    light = np.empty(3 * width, np.float32)
    for row in range(height):
        blur_row(lights, row, (ids[row], shapes, views), (x[row], y[row]), focal, motions, light)
        _develop_row(light, noise[offsets[row] :], (read_sigma, shot), result[row].reshape(3 * width))
    return result


@njit
def blur_row(
    lights: Singles, row: int, scene: tuple[Ids, Shapes, Views], rays: tuple[Singles, Singles], focal: float, motions: Motions, out: Singles
) -> None:
    """Mean colours (3 W,) of one row of colours (H, 3 W); of ids and rays there is only this row."""
    (ids, shapes, views), (x, y), (known, motion) = scene, rays, motions
    width, begin = len(ids), 0
    while begin < width:
        face, end = ids[begin], begin + 1
        while end < width and end - begin < STRIDE and ids[end] == face:
            end += 1
        if not known[face]:
            known[face] = True
            _motion_of(face, shapes, views, motion[face])
        m, u, v = motion[face], x[(begin + end) // 2], y[(begin + end) // 2]
        dz = m[2, 0] * u + m[2, 1] * v + m[2, 2]
        across = (m[0, 0] * u + m[0, 1] * v + m[0, 2] - u * dz) * focal
        down = (m[1, 0] * u + m[1, 1] * v + m[1, 2] - v * dz) * focal
        _smear(lights, row, (begin, end), (across, down), out)
        begin = end


@njit
def _motion_of(face: int, shapes: Shapes, views: Views, out: Singles) -> None:
    """Fill the motion of a face: a point X of a body in the camera's frame moves by D X + d between two views.

    On a plane the depth is 1 over w.r for a ray r, so that the motion over the depth is (D + d w) r.
    """
    (_, planes, bodies, _), (R, o) = shapes, views
    b, w = (bodies[face], nearness(planes[face], R[bodies[face], 0], o[bodies[face], 0])) if face >= 0 else (0, (0.0, 0.0, 0.0))
    for i in range(3):
        d = 0.0
        for k in range(3):
            d += R[b, 1, i, k] * (o[b, 0, k] - o[b, 1, k])
        for j in range(3):
            turned = -1.0 if i == j else 0.0
            for k in range(3):
                turned += R[b, 1, i, k] * R[b, 0, j, k]
            out[i, j] = turned + d * w[j]


@njit
def _smear(lights: Singles, row: int, span: tuple[int, int], way: tuple[float, float], out: Singles) -> None:
    """Means of some pixels of a row over ways that go (across, down) in all and are centred on them."""
    (begin, end), (across, down) = span, way
    length = max(abs(across), abs(down))
    half = min(int(0.5 * length + 0.5), FARTHEST) if length > SHARPEST else 0
    total = 1.0
    for i in range(1, half + 1):
        total += 2.0 * min(0.5 * length - i + 0.5, 1.0)
    r, first, count, own = np.uint64(row), np.uint64(3 * begin), np.uint64(3 * (end - begin)), np.float32(1.0 / total)
    for j in range(count):
        out[first + j] = own * lights[r, first + j]
    for i in range(1, half + 1):
        weight = np.float32(min(0.5 * length - i + 0.5, 1.0) / total)
        _add_pair(lights, row, span, (int(np.rint(i * across / length)), int(np.rint(i * down / length))), weight, out)


@njit
def _add_pair(lights: Singles, row: int, span: tuple[int, int], away: tuple[int, int], weight: np.float32, out: Singles) -> None:
    """Add what is so many pixels away on both sides; what is outside of the picture is taken from its border."""
    (begin, end), (right, below) = span, away
    last, end_of_row = len(lights) - 1, lights.shape[1] // 3
    ahead, behind = np.uint64(min(max(row + below, 0), last)), np.uint64(min(max(row - below, 0), last))
    if begin >= abs(right) and end + abs(right) <= end_of_row:
        first, one, other = np.uint64(3 * begin), np.uint64(3 * (begin + right)), np.uint64(3 * (begin - right))
        for j in range(np.uint64(3 * (end - begin))):  # unsigned: what may be below 0 is looked at one by one
            out[first + j] += weight * (lights[ahead, one + j] + lights[behind, other + j])
        return
    for c in range(begin, end):
        one, other = np.uint64(3 * min(max(c + right, 0), end_of_row - 1)), np.uint64(3 * min(max(c - right, 0), end_of_row - 1))
        for k in range(np.uint64(3)):
            out[np.uint64(3 * c) + k] += weight * (lights[ahead, one + k] + lights[behind, other + k])


@njit
def _develop_row(light: Singles, noise: Singles, sigmas: tuple[float, float], out: Whole) -> None:
    dark, growth, half = np.float32(sigmas[0] * sigmas[0]), np.float32(sigmas[1]), np.float32(0.5)
    low, high = np.float32(0.0), np.float32(255.0)
    for i in range(len(light)):
        value = light[i] + np.sqrt(dark + growth * light[i]) * noise[i]
        out[i] = np.uint8(min(max(value, low), high) + half)
