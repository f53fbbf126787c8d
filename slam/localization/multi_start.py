"""Global start by multi-start: the matching optimisation, from all over the free space."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.errors import require_positive
from slam.kernels import rays
from slam.kernels import starts as kernels
from slam.localization.error_table import ErrorTable
from slam.localization.known_map import KnownMap
from slam.localization.matching_optimisation import MatchingOptimisation
from slam.localization.places import trouble_at
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray

THROUGH = 0.3
"""A beam that ends so far behind a wall has gone through it [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Where the robot may be."""

    T_map_base: SE2
    wrong: float
    """Share of the beams that end on nothing that the map knows, or behind a wall."""


@dataclass(frozen=True, slots=True)
class MultiStart:
    """Where a scan may have been taken. The document needs a start pose; this gives it several, and time tells."""

    spacing: float = 0.25
    """Between starting places [m]; more where there would be more than `most` starts."""
    headings: int = 36
    """Starting headings at every place."""
    most: int = 400_000
    """Most starts that are judged where they are."""
    refined: int = 300
    """Best starts from which the optimisation goes down."""
    beams: int = 60
    """Most beams that judge and refine the starts."""
    width: float = 0.5
    """c by which the starts are judged where they are: half their spacing may be missing [m]."""
    places: int = 12
    """Most places that are kept."""
    apart: tuple[float, float] = (0.5, 0.35)
    """Distance [m] and turn [rad] beyond which two poses are two places."""

    def __post_init__(self) -> None:
        require_positive(self, "spacing", "headings", "most", "refined", "beams", "width", "places")

    def search(self, known_map: KnownMap, table: ErrorTable, matching: MatchingOptimisation, cloud: PointScan) -> list[Place]:
        """The places that explain a scan best, the best first; none for an empty scan."""
        if len(cloud.points) == 0:
            return []
        points = np.ascontiguousarray(cloud.points)
        stride = max(1, len(points) // self.beams)
        inside = (table.patches, table.cell)
        starts = self._starts(known_map, table, np.ascontiguousarray(points[::stride]))
        poses, errors = kernels.refine(points, stride, starts, inside, matching.stages, matching.schedule)
        found: list[Place] = []
        squares = rays.empty_squares(known_map.grid.occupied())
        for i in np.argsort(errors, kind="stable"):
            pose = table.T_map_table @ SE2.from_array(poses[i])
            if not trouble_at(known_map, pose) and not any(same(pose, other.T_map_base, self.apart) for other in found):
                wrong = float(errors[i]) / len(points) + _through_walls(squares, known_map, pose, cloud)
                found.append(Place(pose, min(wrong, 1.0)))
            if len(found) == self.places:
                break
        return sorted(found, key=lambda place: place.wrong)

    def _starts(self, known_map: KnownMap, table: ErrorTable, points: FloatArray) -> FloatArray:
        """(K, 3) the best starts in the table's frame: of every place its best headings, and of these the best."""
        places = table.T_map_table.inverse().transform(self._lattice(known_map.free_points))
        headings: FloatArray = np.linspace(0.0, 2.0 * math.pi, self.headings, endpoint=False, dtype=np.float64)
        E = kernels.rank(points, places, headings, (table.patches, table.cell), self.width)
        valleys = (np.roll(E, 1, axis=1) >= E) & (np.roll(E, -1, axis=1) > E)
        flat = np.flatnonzero(valleys)
        best = flat[np.argsort(E.reshape(-1)[flat], kind="stable")][: self.refined]
        return np.asarray(np.column_stack([places[best // self.headings], headings[best % self.headings]]), np.float64)

    def _lattice(self, points: FloatArray) -> FloatArray:
        """One of the points (N, 2) in every square of the lattice."""
        spacing = self.spacing
        while True:
            _, first = np.unique(np.floor(points / spacing).astype(np.int64), axis=0, return_index=True)
            if len(first) * self.headings <= self.most:
                return points[np.sort(first)]
            spacing *= 1.25


def _through_walls(squares: NDArray[np.uint8], known_map: KnownMap, T_map_base: SE2, cloud: PointScan) -> float:
    """Share of the beams that would have to pass through a wall."""
    grid = known_map.grid
    pose = grid.geometry.T_map_grid.inverse() @ T_map_base
    off = cloud.points - cloud.origins
    origins, measured = pose.transform(cloud.origins), np.hypot(off[:, 0], off[:, 1])
    bearings = np.arctan2(off[:, 1], off[:, 0]) + pose.yaw
    fan = np.ascontiguousarray(np.column_stack([origins, bearings]))
    expected = rays.cast(squares, fan, grid.geometry.resolution, float(measured.max(initial=0.0)) + 1.0)
    return float(np.mean(measured > expected + THROUGH))


def same(a: SE2, b: SE2, apart: tuple[float, float]) -> bool:
    """Whether two poses are no farther apart than a distance [m] and a turn [rad]."""
    step = a.inverse() @ b
    return math.hypot(step.x, step.y) <= apart[0] and abs(step.yaw) <= apart[1]
