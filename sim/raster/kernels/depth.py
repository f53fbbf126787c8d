"""How far what each pixel sees is, and what a stereo camera makes of it."""

from __future__ import annotations

import numpy as np

from sim.raster.kernels.faces import Ids, Shapes, Singles
from sim.raster.kernels.views import Floats, Views
from sim.raster.kernels.visibility import Rays
from slam.kernels.jit import njit

UNITS = 1000.0
"""Of depth to a metre: the camera reports whole millimetres."""
NOWHERE = np.float32(-1e9)
"""Disparity of a pixel that sees nothing [px]."""


@njit
def depths(ids: Ids, shapes: Shapes, views: Views, rays: Rays) -> Singles:
    """Depth (H, W) [m] along the optical axis of the faces that the pixels see; 0 where they see none."""
    (_, planes, bodies, _), (R, o), (x, y, _) = shapes, views, rays
    height, width = ids.shape
    result = np.empty((height, width), np.float32)
    for row in range(height):
        k, begin = min(row, R.shape[1] - 1), 0
        while begin < width:
            face, end = ids[row, begin], begin + 1
            while end < width and ids[row, end] == face:
                end += 1
            if face < 0:
                result[row, begin:end] = 0.0
            else:
                w = nearness(planes[face], R[bodies[face], k], o[bodies[face], k])
                _plane_depths(x[row, begin:end], y[row, begin:end], w, result[row, begin:end])
            begin = end
    return result


@njit
def nearness(plane: Floats, R: Floats, o: Floats) -> tuple[float, float, float]:
    """What a ray (x, y, 1) is multiplied with to get one over the depth at which it meets a plane."""
    distance = plane[3] - (plane[0] * o[0] + plane[1] * o[1] + plane[2] * o[2])
    return (
        (R[0, 0] * plane[0] + R[0, 1] * plane[1] + R[0, 2] * plane[2]) / distance,
        (R[1, 0] * plane[0] + R[1, 1] * plane[1] + R[1, 2] * plane[2]) / distance,
        (R[2, 0] * plane[0] + R[2, 1] * plane[1] + R[2, 2] * plane[2]) / distance,
    )


@njit
def _plane_depths(x: Singles, y: Singles, w: tuple[float, float, float], out: Singles) -> None:
    wx, wy, w1, one = np.float32(w[0]), np.float32(w[1]), np.float32(w[2]), np.float32(1.0)
    for i in range(len(x)):
        out[i] = one / (wx * x[i] + wy * y[i] + w1)


@njit
def measure(
    depth: Singles,
    ids: Ids,
    lost: Singles,
    noise: Singles,
    patches: Singles,
    law: tuple[float, float, float, float],
    limits: tuple[float, float],
) -> Singles:
    """What a stereo camera reports (H, W) [m], in whole `UNITS`; nan where it reports nothing.

    The pixels are those of the left of two imagers. A point at depth z is seen f B / z pixels farther left in the right one; an error
    of s pixels there is one of z^2 s / (f B) in depth. What a nearer point hides from the right imager, and what lies outside of its
    picture, is not measured.

    Args:
        depth: (H, W) true depth [m], 0 where there is nothing.
        ids: (H, W) face that each pixel sees; -1 for none.
        lost: (F + 1,) share of the measurements that fail on each face; the last is for none.
        noise: (H, W) of deviation 1.
        patches: (H, W) even between 0 and 1: a measurement fails where this is less than its share.
        law: f B [m px], s [px], steps of disparity to a pixel or 0, above 0 if what is hidden from the right imager is not measured.
        limits: nearest and farthest depth [m].
    """
    constant, sigma, steps, hides = law
    height, width = depth.shape
    reported, disparity = np.empty((height, width), np.float32), np.empty(width, np.float32)
    for row in range(height):
        _disparities(depth[row], constant, disparity)
        if hides > 0.0:
            _hide(disparity)
        _match(disparity, noise[row], (sigma, steps))
        _report(disparity, constant, limits, reported[row])
        _lose(ids[row], lost, patches[row], reported[row])
    return reported


@njit
def _disparities(depth: Singles, constant: float, out: Singles) -> None:
    """Disparities (W,) [px] of depths (W,)."""
    product, zero = np.float32(constant), np.float32(0.0)
    for i in range(len(depth)):
        out[i] = product / depth[i] if depth[i] > zero else NOWHERE


@njit
def _hide(disparity: Singles) -> None:
    """Take away what the right imager does not see in a row (W,)."""
    leftmost, zero = np.float32(len(disparity)), np.float32(0.0)
    for i in range(len(disparity) - 1, -1, -1):
        in_right = np.float32(i) - disparity[i]
        hidden = (in_right < zero) | (in_right >= leftmost)
        leftmost = min(leftmost, in_right)
        disparity[i] = NOWHERE if hidden else disparity[i]


@njit
def _match(disparity: Singles, noise: Singles, errors: tuple[float, float]) -> None:
    """Add the noise of the match to a row (W,) of disparities, and round them to its steps."""
    sigma, steps = np.float32(errors[0]), np.float32(errors[1])
    if sigma > 0.0:
        for i in range(len(disparity)):
            disparity[i] += sigma * noise[i]
    if steps > 0.0:
        for i in range(len(disparity)):
            disparity[i] = np.rint(disparity[i] * steps) / steps


@njit
def _report(disparity: Singles, constant: float, limits: tuple[float, float], out: Singles) -> None:
    """Depths (W,) [m] of disparities (W,); nan where they are outside of the limits."""
    product, units, zero, nothing = np.float32(constant), np.float32(UNITS), np.float32(0.0), np.float32(np.nan)
    nearest, farthest = np.float32(limits[0]), np.float32(limits[1])
    for i in range(len(disparity)):
        z = product / disparity[i]
        out[i] = np.rint(z * units) / units if (disparity[i] > zero) & (z >= nearest) & (z <= farthest) else nothing


@njit
def _lose(ids: Ids, lost: Singles, patches: Singles, out: Singles) -> None:
    """Take away what is lost on difficult surfaces from a row (W,) of depths."""
    nothing, begin, width = np.float32(np.nan), 0, len(ids)
    while begin < width:
        face, end = ids[begin], begin + 1
        while end < width and ids[end] == face:
            end += 1
        share = lost[face]
        if share > 0.0:
            for i in range(begin, end):
                out[i] = nothing if patches[i] < share else out[i]
        begin = end
