"""What a face's pixels in one row have in common."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.raster.kernels.views import Floats
from slam.kernels.jit import njit

Singles = NDArray[np.float32]
Ids = NDArray[np.int32]
Shapes = tuple[Floats, Floats, Ids, Singles]
"""Corners (F, 4, 3), planes (F, 4) as n and d, body (F,), and lift (F,): how much nearer a face is taken to be than it is."""

W, S, T, EDGES, DISTANCE, LIFT, COUNT = 0, 3, 6, 9, 21, 22, 23
"""Places of a face's coefficients: of w, of s w and t w, which are linear in a pixel's ray (x, y, 1), of its four edges, which are positive
inside, its plane's distance from the camera, below 0 in front of it, and its lift. (s, t) is the place on its texture, 1 / w the depth."""


BLOCK = 16
"""Rows over which coefficients go evenly from one end to the other."""


@njit
def shape_of(corners: Floats, plane: Floats, R: Floats, o: Floats, c: Floats) -> None:
    """Fill a face's coefficients of depth and edges, seen from `o` (3,) along axes `R` (3, 3).

    A ray r meets the plane n.p = d at depth 1 / w with w = (R n).r / (d - n.o); it passes inside the edge from a to b where
    (b x a).r >= 0 in the camera's frame (Olano and Greer, "Triangle scan conversion using 2D homogeneous coordinates", 1997).
    """
    distance = plane[3] - (plane[0] * o[0] + plane[1] * o[1] + plane[2] * o[2])
    c[DISTANCE] = distance
    scale = 1.0 / distance if distance != 0.0 else 0.0
    for i in range(3):
        c[W + i] = (R[i, 0] * plane[0] + R[i, 1] * plane[1] + R[i, 2] * plane[2]) * scale
    bx, by, bz = in_camera(corners, 0, R, o)
    for i in range(4):
        ax, ay, az = bx, by, bz
        bx, by, bz = in_camera(corners, (i + 1) % 4, R, o)
        e = EDGES + 3 * i
        c[e], c[e + 1], c[e + 2] = by * az - bz * ay, bz * ax - bx * az, bx * ay - by * ax


@njit
def in_camera(corners: Floats, i: int, R: Floats, o: Floats) -> tuple[float, float, float]:
    """A corner in the frame of a camera at `o` (3,) with axes `R` (3, 3)."""
    x, y, z = corners[i, 0] - o[0], corners[i, 1] - o[1], corners[i, 2] - o[2]
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@njit
def texture_of(mapping: Floats, R: Floats, o: Floats, c: Floats) -> None:
    """Fill a face's coefficients of its texture, after those of its depth: a ray r meets it at s = U.o + u0 + (R U).r / w."""
    s = mapping[0, 0] * o[0] + mapping[0, 1] * o[1] + mapping[0, 2] * o[2] + mapping[0, 3]
    t = mapping[1, 0] * o[0] + mapping[1, 1] * o[1] + mapping[1, 2] * o[2] + mapping[1, 3]
    for i in range(3):
        c[S + i] = s * c[W + i] + R[i, 0] * mapping[0, 0] + R[i, 1] * mapping[0, 1] + R[i, 2] * mapping[0, 2]
        c[T + i] = t * c[W + i] + R[i, 0] * mapping[1, 0] + R[i, 1] * mapping[1, 1] + R[i, 2] * mapping[1, 2]


@njit
def begin_block(corners: Floats, plane: Floats, R: Floats, o: Floats, row: int, c: Floats, slope: Floats) -> None:
    """Fill a face's coefficients of depth and edges in a row, and what they grow by from there to the next of its `BLOCK`.

    Of the body's views `R` (K, 3, 3) and `o` (K, 3) there is one for each row, or one for them all.
    """
    count = len(R)
    end = min(row - row % BLOCK + BLOCK, count - 1)
    if end > row:
        shape_of(corners, plane, R[end], o[end], slope)
    k = min(row, count - 1)
    shape_of(corners, plane, R[k], o[k], c)
    for i in range(LIFT):
        slope[i] = (slope[i] - c[i]) / (end - row) if end > row else 0.0
