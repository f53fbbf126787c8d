"""The faces of a finished map: for every occupied cell the wall that it is part of, so that beams can be cast exactly."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.kernels import beam_geometry as kernels
from slam.kernels.rays import empty_squares
from slam.localization.known_map import KnownMap
from slam.localization.wall_segments import WallSegments
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray

PARALLEL = math.radians(1.0)
"""Walls whose directions differ by less are parallel: a corridor's two walls know nothing of the way along it."""
NEAR = 1.5
"""A wall's cells are so near to it, in cells."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """What beams should measure at a pose."""

    ranges: FloatArray
    """(M,) [m]; inf where nothing is within reach."""
    gradients: FloatArray
    """(M, 3) of the ranges by x, y [1], yaw [m/rad] of base, in the map."""
    cosines: FloatArray
    """(M,) of the angles of incidence; 0 where what is hit is no wall: it tells nothing of directions."""


class MapFaces:
    """The walls of one map, made for casting rays."""

    def __init__(self, known_map: KnownMap, walls: WallSegments | None = None) -> None:
        """Find the walls of a map; what is not straight has no direction."""
        grid = known_map.grid
        self.T_grid_map = grid.geometry.T_map_grid.inverse()
        self._resolution = grid.geometry.resolution
        occupied = grid.occupied()
        self._squares = empty_squares(occupied)
        segments = (walls or WallSegments()).of(grid).segments
        ends = self.T_grid_map.transform(segments.reshape(-1, 2)).reshape(-1, 4)
        self._lines = _lines(ends)
        cells = np.argwhere(occupied)
        hits: FloatArray = (cells[:, ::-1] + 0.5) * self._resolution + grid.hit_offset[occupied].astype(np.float64)
        self._numbers: NDArray[np.int32] = np.full(occupied.shape, -1, np.int32)
        self._numbers[occupied] = _owners(hits, ends, NEAR * self._resolution)

    def look(self, T_map_base: SE2, cloud: PointScan, reach: float) -> Sight:
        """What the beams of a scan should measure at a pose, up to a range [m]."""
        pose = self.T_grid_map @ T_map_base
        beams = np.ascontiguousarray(cloud.origins), np.ascontiguousarray(cloud.points)
        ranges, gradients, cosines = kernels.look(
            pose.as_array(), beams, self._squares, (self._numbers, self._lines), (self._resolution, reach)
        )
        gradients[:, :2] = gradients[:, :2] @ self.T_grid_map.rotation()
        return Sight(ranges, gradients, cosines)


def _lines(ends: FloatArray) -> FloatArray:
    """(S, 4) middle and unit normal of segments (S, 4); those that are parallel but for their own error have one normal."""
    along = ends[:, 2:] - ends[:, :2]
    lengths, angles = np.hypot(along[:, 0], along[:, 1]), np.arctan2(along[:, 1], along[:, 0])
    normals, done = np.empty((len(ends), 2)), np.zeros(len(ends), np.bool_)
    for i in np.argsort(-lengths, kind="stable").tolist():
        if done[i]:
            continue
        off = 0.5 * np.angle(np.exp(2j * (angles - angles[i])))
        alike = ~done & (abs(off) < PARALLEL)
        angle = angles[i] + float(np.average(off[alike], weights=lengths[alike] ** 3))  # 1 / variance of a fitted direction
        normals[alike] = -math.sin(angle), math.cos(angle)
        done |= alike
    return np.column_stack([0.5 * (ends[:, :2] + ends[:, 2:]), normals])


def _owners(hits: FloatArray, ends: FloatArray, near: float) -> NDArray[np.int32]:
    """Number (N,) of the segment nearest to each hit (N, 2), -1 for none that is near."""
    best, owners = np.full(len(hits), near), np.full(len(hits), -1, np.int32)
    for number, (x0, y0, x1, y1) in enumerate(ends.tolist()):
        along = np.array([x1 - x0, y1 - y0])
        length = float(np.hypot(*along))
        along /= length
        off = hits - np.array([x0, y0])
        beyond = np.maximum(np.maximum(-(off @ along), off @ along - length), 0.0)
        distance = np.hypot(off @ np.array([-along[1], along[0]]), beyond)
        nearer = distance < best
        best[nearer], owners[nearer] = distance[nearer], number
    return owners
