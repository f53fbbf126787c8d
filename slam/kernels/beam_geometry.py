"""What every beam should measure in a known map, and how that changes with the pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.rays import cast

Floats = NDArray[np.float64]

FLATTEST = 0.05
"""Least cosine of an incidence angle: along a wall the range says nothing that could be believed."""
OFF_LINE = 0.3
"""The line of a face is not met farther from where the ray enters its cell, else the cell's own side counts [m]."""


@njit
def look(
    pose: Floats,
    beams: tuple[Floats, Floats],
    squares: NDArray[np.uint8],
    faces: tuple[NDArray[np.int32], Floats],
    scale: tuple[float, float],
) -> tuple[Floats, Floats, Floats]:
    """Expected ranges, their gradients by the pose, and incidence, of beams from a pose.

    Args:
        pose: (3,) x, y [m], yaw [rad] of base in the grid's frame.
        beams: origins (M, 2) and ends (M, 2) in base [m].
        squares: of `rays.empty_squares`.
        faces: number of the face of each cell (H, W), -1 for none; faces (F, 4): a point [m] and the unit normal, in the grid's frame.
        scale: cell size, farthest distance that counts [m].

    Returns:
        ranges (M,) [m], inf for no hit; gradients g (M, 3) [1, 1, m/rad] along the grid's axes, after Censi, "On achievable accuracy
        for range-finder localization" (2007): (-n_x / (n.u), -n_y / (n.u), -n.(z x e) / (n.u)) with the end e seen from base; cosine
        (M,) of the angle of incidence, 0 where what is hit has no direction.
    """
    origins, ends = beams
    c, s = np.cos(pose[2]), np.sin(pose[2])
    count = len(ends)
    rays = np.empty((count, 3))
    for i in range(count):
        ox, oy = origins[i, 0], origins[i, 1]
        rays[i, 0], rays[i, 1] = pose[0] + c * ox - s * oy, pose[1] + s * ox + c * oy
        rays[i, 2] = pose[2] + np.arctan2(ends[i, 1] - oy, ends[i, 0] - ox)
    ranges = cast(squares, rays, scale[0], scale[1])
    gradients, cosines = np.zeros((count, 3)), np.zeros(count)
    for i in range(count):
        if not np.isfinite(ranges[i]):
            continue
        ux, uy = np.cos(rays[i, 2]), np.sin(rays[i, 2])
        ranges[i], nx, ny, flat = _surface((rays[i, 0], rays[i, 1], ux, uy), ranges[i], faces, scale[0])
        cosine = nx * ux + ny * uy
        if flat:
            cosines[i] = abs(cosine)
        if abs(cosine) < FLATTEST:
            cosine = FLATTEST if cosine > 0.0 else -FLATTEST
        ex, ey = rays[i, 0] + ranges[i] * ux - pose[0], rays[i, 1] + ranges[i] * uy - pose[1]
        gradients[i, 0], gradients[i, 1] = -nx / cosine, -ny / cosine
        gradients[i, 2] = -(ny * ex - nx * ey) / cosine
    return ranges, gradients, cosines


@njit
def _surface(
    ray: tuple[float, float, float, float], entered: float, faces: tuple[NDArray[np.int32], Floats], resolution: float
) -> tuple[float, float, float, bool]:
    """Range [m] and unit normal of what a ray meets in the cell that it enters, and whether that is a face."""
    x, y, ux, uy = ray
    numbers, lines = faces
    inside = entered + 1e-6
    row, col = int((y + inside * uy) / resolution), int((x + inside * ux) / resolution)
    row, col = min(max(row, 0), numbers.shape[0] - 1), min(max(col, 0), numbers.shape[1] - 1)
    number = numbers[row, col]
    if number < 0:
        return entered + 0.5 * resolution, -ux, -uy, False
    nx, ny = lines[number, 2], lines[number, 3]
    cosine = nx * ux + ny * uy
    distance = nx * (lines[number, 0] - x) + ny * (lines[number, 1] - y)
    if abs(cosine) < FLATTEST:
        return entered, nx, ny, True
    met = distance / cosine
    return (met if abs(met - entered) < OFF_LINE else entered), nx, ny, True
