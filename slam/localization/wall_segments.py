"""Wall segments of a finished map: edges, probabilistic Hough transform, least squares on the raw hits.

The Hough transform sees the cells of the map and tells only where walls are, to half a cell. What is kept of it are its hits: every
segment is fitted anew to the mean hits of the cells near it, which are known far better than the cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from slam.errors import require_not_negative, require_positive
from slam.grid import FREE, OccupancyGrid
from slam.kernels.facing import facing_of
from slam.se2 import FloatArray

CANNY = (50, 150)
"""Thresholds of the edge detector; the picture is black and white, so that any will do."""
ANGLE = math.pi / 360.0
"""Step of the Hough transform's angle [rad]."""
HOUGH_SEED = 1
"""OpenCV draws the pixels that vote from one stream for the whole process: without a seed every call would find other segments."""
FEWEST = 4
"""Hits that make a wall."""


@dataclass(frozen=True, slots=True, eq=False)
class Walls:
    """What a map's walls are made of, in the map's frame."""

    segments: FloatArray
    """(S, 4) x0 y0 x1 y1 [m]; the free side is on the left, seen from the first end."""
    points: FloatArray
    """(P, 2) hits that belong to no segment [m]."""


@dataclass(frozen=True, slots=True)
class WallSegments:
    """How walls are found."""

    votes: int = 8
    """Cells on one line that make the Hough transform take it for a wall."""
    length_min: float = 0.3
    """Shortest segment [m]."""
    gap: float = 0.2
    """Longest gap in a wall that it bridges [m]."""
    wide: float = 1.2
    """A hit belongs to a segment of the Hough transform within so many cells of it."""
    near: float = 0.03
    """A hit belongs to a fitted segment within this distance [m]."""
    straight: float = 0.012
    """Largest root mean square distance of a segment's hits to it [m]: what bends is no wall."""
    fits: int = 3
    """How often a segment is fitted to the hits that lie near the last fit."""

    def __post_init__(self) -> None:
        require_positive(self, "votes", "length_min", "wide", "near", "straight", "fits")
        require_not_negative(self, "gap")

    def of(self, grid: OccupancyGrid) -> Walls:
        """Find the walls of a map. A hit belongs to the longest segment that it fits: doubles of the Hough transform find none."""
        hits = _Hits.of(grid)
        segments: list[FloatArray] = []
        for ends in self._hough(grid):
            for begin, end in (ends.reshape(2, 2), ends.reshape(2, 2)[::-1]):
                found = self._fitted(begin, end, hits, self.wide * grid.geometry.resolution)
                if found is not None:
                    segment, members = found
                    hits.free[members] = False
                    segments.append(segment)
        return Walls(np.array(segments).reshape(-1, 4), hits.points[hits.free])

    def _hough(self, grid: OccupancyGrid) -> FloatArray:
        """(N, 4) straight edges of the map's picture [m] in the map, the longest first."""
        resolution = grid.geometry.resolution
        picture = np.where(grid.occupied(), np.uint8(255), np.uint8(0))
        edges = cv2.Canny(picture, *CANNY)
        shortest, gap = self.length_min / resolution, self.gap / resolution
        cv2.setRNGSeed(HOUGH_SEED)
        lines = cv2.HoughLinesP(edges, 1.0, ANGLE, self.votes, minLineLength=shortest, maxLineGap=gap)
        pixels = np.empty((0, 2)) if lines is None else np.asarray(lines, np.float64).reshape(-1, 2)
        ends = grid.geometry.T_map_grid.transform((pixels + 0.5) * resolution).reshape(-1, 4)
        lengths = np.hypot(ends[:, 2] - ends[:, 0], ends[:, 3] - ends[:, 1])
        return ends[np.argsort(-lengths, kind="stable")]

    def _fitted(self, begin: FloatArray, end: FloatArray, hits: _Hits, width: float) -> tuple[FloatArray, NDArray[np.int64]] | None:
        """The segment (4,) through the hits on the left of an edge, and the numbers of those hits; None where they are no wall."""
        middle, along = 0.5 * (begin + end), (end - begin) / max(float(np.hypot(*(end - begin))), 1e-9)
        members, spread = np.empty(0, np.int64), math.inf
        for _ in range(self.fits):
            members = self._members(middle, along, hits, width)
            if len(members) < FEWEST:
                return None
            middle, direction, spread = hits.line(members, along)
            along, width = direction, self.near
        reach = (hits.points[members] - middle) @ along
        if spread > self.straight or float(np.ptp(reach)) < self.length_min:
            return None
        return np.concatenate([middle + reach.min() * along, middle + reach.max() * along]), members

    def _members(self, middle: FloatArray, along: FloatArray, hits: _Hits, width: float) -> NDArray[np.int64]:
        """Numbers of the free hits near a line that face its left, from its middle on as far as no gap comes."""
        normal = np.array([-along[1], along[0]])
        off = hits.points - middle
        near = np.flatnonzero(hits.free & (np.abs(off @ normal) <= width) & (hits.facing @ normal >= 0.0))
        reach = off[near] @ along
        order = np.argsort(reach, kind="stable")
        near, reach = near[order], reach[order]
        if len(near) == 0:
            return near
        stretch = np.concatenate([[0], np.cumsum(np.diff(reach) > self.gap)])
        return near[stretch == stretch[int(np.argmin(np.abs(reach)))]]


@dataclass(frozen=True, slots=True, eq=False)
class _Hits:
    """The mean hits of the occupied cells."""

    points: FloatArray  # (N, 2) in the map [m]
    facing: FloatArray  # (N, 2) in the map, towards the free side; 0 where both are
    counts: FloatArray  # (N,)
    free: NDArray[np.bool_]  # (N,) whether they belong to no segment yet
    resolution: float

    @classmethod
    def of(cls, grid: OccupancyGrid) -> _Hits:
        rows, cols = np.nonzero(grid.occupied())
        facing = facing_of(grid.occupied(), grid.states() == FREE)[rows, cols].astype(np.float64)
        counts = np.maximum(grid.hit_count[rows, cols].astype(np.float64), 1.0)
        R = grid.geometry.T_map_grid.rotation()
        return cls(grid.wall_points(), facing @ R.T, counts, np.ones(len(rows), np.bool_), grid.geometry.resolution)

    def line(self, members: NDArray[np.int64], along: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Middle (2,), direction (2,) about as `along`, and root mean square distance of the line through some of the hits.

        Hits in a row across the line are averaged first: a wall on the border of two cells lies between their means.
        """
        points, counts = self.points[members], self.counts[members]
        slots = np.floor(points @ along / self.resolution).astype(np.int64)
        _, slots = np.unique(slots, return_inverse=True)
        total = np.bincount(slots, counts)
        means = np.column_stack([np.bincount(slots, counts * points[:, axis]) / total for axis in range(2)])
        middle = means.mean(axis=0)
        _, values, directions = np.linalg.svd(means - middle, full_matrices=False)
        direction = directions[0] if directions[0] @ along >= 0.0 else -directions[0]
        return middle, direction, float(values[-1]) / math.sqrt(len(means))
