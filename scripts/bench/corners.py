"""Corners of a marker in a picture, from lines fitted to the edges of its black square: what the renderer's accuracy is judged by."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from hardware.camera_spec import Imager
from sim.raster.lens import distorted, undistorted
from slam.se2 import FloatArray

ALONG = (0.1, 0.9)
"""Part of a side that its edge is sampled along."""
SAMPLES = 96
"""Places along a side."""
REACH, STEP = 3.0, 0.25
"""How far the picture is sampled across an edge, and how densely [px]."""
NEAR_PEAK = 1.75
"""What of the gradient is averaged about its peak [px]."""


def fitted_corners(grey: NDArray[np.float64], guess: FloatArray, imager: Imager) -> FloatArray:
    """Corners (4, 2) [px] of a black quadrilateral on white near a guess (4, 2), clockwise in the picture.

    Lines are fitted where the lens would leave them straight.
    """
    corners = guess
    for _ in range(2):
        edges = [_straightened(_edge(grey, corners[i], corners[(i + 1) % 4]), imager) for i in range(4)]
        lines = [_robust_line(edge) for edge in edges]
        straight = np.array([_meeting(lines[i - 1], lines[i]) for i in range(4)])
        corners = np.column_stack(distorted(*straight.T, imager.distortion)) * imager.focal + imager.centre
    return corners


def _straightened(points: FloatArray, imager: Imager) -> FloatArray:
    """Rays at z = 1 (N, 2) of pixels (N, 2)."""
    return np.column_stack(undistorted(*((points - imager.centre) / imager.focal).T, imager.distortion))


def _edge(grey: NDArray[np.float64], a: FloatArray, b: FloatArray) -> FloatArray:
    """Points (SAMPLES, 2) [px] on the edge between two corners."""
    along = (b - a) / np.linalg.norm(b - a)
    outward = np.array([along[1], -along[0]])
    places = a + np.linspace(*ALONG, SAMPLES)[:, None] * (b - a)  # (SAMPLES, 2)
    offsets = np.arange(-REACH, REACH + STEP / 2, STEP)
    points = places[:, None] + offsets[:, None] * outward  # (SAMPLES, offsets, 2)
    gradient = np.maximum(np.diff(map_coordinates(grey, points.transpose(2, 0, 1)[::-1], order=1), axis=1), 0.0)
    middles = 0.5 * (offsets[1:] + offsets[:-1])
    near = np.abs(middles - middles[gradient.argmax(axis=1)][:, None]) <= NEAR_PEAK
    weights = np.where(near, gradient, 0.0)
    return places + ((weights @ middles) / np.maximum(weights.sum(axis=1), 1e-9))[:, None] * outward


def _robust_line(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Total least squares, repeated without the points beyond three deviations."""
    kept = points
    for _ in range(3):
        middle = kept.mean(axis=0)
        direction = np.linalg.svd(kept - middle, full_matrices=False)[2][0]
        away = np.abs((points - middle) @ np.array([direction[1], -direction[0]]))
        kept = points[away <= max(3.0 * float(np.median(away)), 3e-5)]
    return middle, direction


def _meeting(a: tuple[FloatArray, FloatArray], b: tuple[FloatArray, FloatArray]) -> FloatArray:
    share = np.linalg.solve(np.column_stack([a[1], -b[1]]), b[0] - a[0])
    return a[0] + share[0] * a[1]
