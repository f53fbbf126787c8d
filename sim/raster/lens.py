"""A lens: the ray of every pixel, and the pixel of every point."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from hardware.camera_spec import Imager
from slam.se2 import FloatArray

Singles = NDArray[np.float32]
_ITERATIONS = 60
"""Of the inversion of the distortion; the lens of a D435 needs fewer than 10."""


@dataclass(frozen=True, slots=True, eq=False)
class Lens:
    """The rays of an imager's pixels, in its optical frame at z = 1; the centre of pixel (column i, row j) is at (i, j)."""

    x: Singles
    """(H, W)"""
    y: Singles
    """(H, W)"""
    y_spans: FloatArray
    """(H, 2) lowest and highest y of each row, rising from row to row."""
    step: float
    """From pixel to pixel at the principal point."""


@cache
def lens_of(imager: Imager) -> Lens:
    """The rays of an imager, made once."""
    (fx, fy), (cx, cy) = imager.focal, imager.centre
    columns, rows = np.meshgrid(np.arange(imager.width, dtype=np.float64), np.arange(imager.height, dtype=np.float64))
    x, y = undistorted((columns - cx) / fx, (rows - cy) / fy, imager.distortion)
    lows, highs = np.minimum.accumulate(y.min(axis=1)[::-1])[::-1], np.maximum.accumulate(y.max(axis=1))
    margin = 1e-6
    return Lens(x.astype(np.float32), y.astype(np.float32), np.column_stack([lows - margin, highs + margin]), 2.0 / (fx + fy))


def project(imager: Imager, points: FloatArray) -> FloatArray:
    """Pixels (N, 2) of points (N, 3) [m] in the optical frame, through the distortion."""
    x, y = distorted(points[:, 0] / points[:, 2], points[:, 1] / points[:, 2], imager.distortion)
    return np.column_stack([x * imager.focal[0] + imager.centre[0], y * imager.focal[1] + imager.centre[1]])


def distorted(x: FloatArray, y: FloatArray, distortion: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Where the lens puts a ray. Brown, "Decentering distortion of lenses" (1966), with OpenCV's order k1 k2 p1 p2 k3."""
    k1, k2, p1, p2, k3 = distortion
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y


def undistorted(x: FloatArray, y: FloatArray, distortion: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """The ray that the lens puts at (x, y): the inverse of `distorted`, by fixed-point iteration."""
    ray_x, ray_y = x, y
    for _ in range(_ITERATIONS if any(distortion) else 0):
        seen_x, seen_y = distorted(ray_x, ray_y, distortion)
        ray_x, ray_y = ray_x + x - seen_x, ray_y + y - seen_y
    return ray_x, ray_y
