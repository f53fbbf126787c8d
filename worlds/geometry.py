"""Distances of segments in the plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def sides(polygon: FloatArray) -> FloatArray:
    """Sides (N, 4) as x0 y0 x1 y1 of a closed polygon (N, 2)."""
    return np.hstack([polygon, np.roll(polygon, -1, axis=0)])


def contains(polygon: FloatArray, point: FloatArray) -> bool:
    """Whether a convex counter-clockwise polygon (N, 2) holds a point (2,)."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    return bool(np.all(_cross(edges, point - polygon) >= 0.0))


def clearance(a: FloatArray, b: FloatArray, polygons: list[FloatArray]) -> float:
    """Distance [m] between the segment from `a` to `b` (2,) and the nearest convex solid polygon (N, 2); 0 where they meet."""
    outlines = np.vstack([sides(polygon) for polygon in polygons])
    c, d = outlines[:, :2], outlines[:, 2:]
    if any(contains(polygon, a) for polygon in polygons) or np.any(_crosses(a, b, c, d)):
        return 0.0
    ends_to_sides = [_point_distances(np.broadcast_to(end, c.shape), c, d) for end in (a, b)]
    corners_to_segment = _point_distances(c, np.broadcast_to(a, c.shape), np.broadcast_to(b, c.shape))
    return float(np.min([corners_to_segment, *ends_to_sides]))


def _crosses(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> NDArray[np.bool_]:
    """Which segments c-d (N, 2) properly cross the segment a-b, (N,)."""
    split_by_ab = _cross(b - a, c - a) * _cross(b - a, d - a) < 0.0
    split_by_cd = _cross(d - c, a - c) * _cross(d - c, b - c) < 0.0
    return split_by_ab & split_by_cd


def _point_distances(points: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Distance of each point (N, 2) to its segment c-d (N, 2), (N,). A segment may be a point."""
    along = d - c
    length_squared = np.maximum(np.sum(along * along, axis=1), 1e-30)
    fraction = np.clip(np.sum((points - c) * along, axis=1) / length_squared, 0.0, 1.0)
    return np.linalg.norm(points - c - fraction[:, None] * along, axis=1)


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
