"""Distances of segments in the plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class Polygons:
    """Convex counter-clockwise polygons, each (N, 2), kept as the sides of all of them."""

    def __init__(self, polygons: list[FloatArray]) -> None:
        self._outlines = np.vstack([np.empty((0, 4)), *(sides(polygon) for polygon in polygons)])
        self._first = np.cumsum([0, *(len(polygon) for polygon in polygons[:-1])]) if polygons else np.empty(0, np.int64)

    @property
    def begins(self) -> FloatArray:
        """Corners (N, 2) where the sides begin."""
        return self._outlines[:, :2]

    @property
    def ends(self) -> FloatArray:
        """Corners (N, 2) where the sides end."""
        return self._outlines[:, 2:]

    def holds(self, point: FloatArray) -> bool:
        """Whether any of them holds a point (2,)."""
        left = _cross(self.ends - self.begins, point - self.begins) >= 0.0
        return bool(np.any(np.logical_and.reduceat(left, self._first))) if len(self._first) else False


def sides(polygon: FloatArray) -> FloatArray:
    """Sides (N, 4) as x0 y0 x1 y1 of a closed polygon (N, 2)."""
    return np.hstack([polygon, np.roll(polygon, -1, axis=0)])


def contains(polygon: FloatArray, point: FloatArray) -> bool:
    """Whether a convex counter-clockwise polygon (N, 2) holds a point (2,)."""
    return Polygons([polygon]).holds(point)


def clearance(a: FloatArray, b: FloatArray, polygons: Polygons) -> float:
    """Distance [m] between the segment from `a` to `b` (2,) and the nearest solid polygon; 0 where they meet."""
    c, d = polygons.begins, polygons.ends
    if polygons.holds(a) or np.any(_crosses(a, b, c, d)):
        return 0.0
    ends_to_sides = [point_distances(np.broadcast_to(end, c.shape), c, d) for end in (a, b)]
    corners_to_segment = point_distances(c, np.broadcast_to(a, c.shape), np.broadcast_to(b, c.shape))
    return float(np.min([corners_to_segment, *ends_to_sides], initial=np.inf))


def _crosses(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> NDArray[np.bool_]:
    """Which segments c-d (N, 2) properly cross the segment a-b, (N,)."""
    split_by_ab = _cross(b - a, c - a) * _cross(b - a, d - a) < 0.0
    split_by_cd = _cross(d - c, a - c) * _cross(d - c, b - c) < 0.0
    return split_by_ab & split_by_cd


def point_distances(points: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Distance of each point (N, 2) to its segment c-d (N, 2), (N,). A segment may be a point."""
    along = d - c
    length_squared = np.maximum(np.sum(along * along, axis=1), 1e-30)
    fraction = np.clip(np.sum((points - c) * along, axis=1) / length_squared, 0.0, 1.0)
    return np.linalg.norm(points - c - fraction[:, None] * along, axis=1)


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def apart(p: FloatArray, q: FloatArray, gap: float) -> bool:
    """Whether two convex counter-clockwise polygons (N, 2) keep `gap` [m], found on the normals of their sides: corners facing corners
    may be refused a little early.
    """
    return any(_beyond(a, b, gap) for a, b in ((p, q), (q, p)))


def _beyond(p: FloatArray, q: FloatArray, gap: float) -> bool:
    """Whether all of `q` lies `gap` outside of one side of `p`."""
    along = np.roll(p, -1, axis=0) - p
    outward = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    distances = outward @ q.T - np.sum(outward * p, axis=1)[:, None]
    return bool(np.any(distances.min(axis=1) >= gap))
