"""One local map: a region of places, its grid in its own frame, and the scans kept for polishing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.errors import MapTooLargeError
from slam.grid import OccupancyGrid
from slam.kernels import sight
from slam.mapping.compact_grid import CompactGrid
from slam.mapping.grid_mapper import GridMapper, MapSettings
from slam.matching.surface_field import SurfaceField
from slam.motion.keyframes import KeyframeGate
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray

FREE = -0.8
"""Log-odds of a cell that is surely free: four misses."""
NEAR = 0.2
"""A point farther than this from every surface, in free space, contradicts the map [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Keyframe:
    """A scan that is kept."""

    stamp: float
    T_submap_base: SE2
    points: NDArray[np.float32]
    """(M, 2) in base [m]."""
    origins: NDArray[np.float32]
    """(M, 2) in base [m]."""
    widens: bool = True
    """The submap is the map of the places around it; else it came when the submap was full, and only shows what is seen from there."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """How a scan fits a local map at a pose, as shares of its points."""

    known: float
    """In cells that the map knows."""
    contradicting: float
    """In free space, far from every surface."""
    behind: float
    """At walls of which the map knows only the other side: they may lie anywhere."""


class Submap:
    """Its origin is where the robot was when it was begun."""

    def __init__(self, number: int, stamp: float, T_map_submap: SE2, settings: MapSettings) -> None:
        self.number = number
        self.stamp = stamp
        """Of the scan at its origin [s]."""
        self.T_map_submap = T_map_submap
        self.keyframes: list[Keyframe] = []
        self.scans = 0
        """Inserted so far."""
        self.travelled = 0.0
        """Way between the kept scans that widen it, in the order in which they came [m]."""
        self._places: FloatArray = np.empty((0, 3))  # of the kept scans
        self._centres: FloatArray = np.empty((0, 3))  # of those that widen it
        self._settings = settings
        self._mapper: GridMapper | None = GridMapper(settings)
        self._compact: CompactGrid | None = None

    @classmethod
    def restore(cls, origin: tuple[int, float, SE2], settings: MapSettings, compact: CompactGrid, keyframes: list[Keyframe]) -> Submap:
        """As it was saved; `origin` is its number, stamp and pose."""
        submap = cls(*origin, settings)
        submap._mapper, submap._compact, submap.scans = None, compact, len(keyframes)
        for keyframe in keyframes:
            submap.keep(keyframe)
        return submap

    @property
    def mapper(self) -> GridMapper:
        """The grid, unpacked."""
        if self._mapper is None:
            grid, facing = self._compact.unpacked() if self._compact else (None, None)
            self._mapper = GridMapper(self._settings, grid, facing)
        return self._mapper

    @property
    def surfaces(self) -> SurfaceField:
        """What scans are matched to."""
        return self.mapper.field

    @property
    def grid(self) -> OccupancyGrid:
        """Unpacked."""
        return self.mapper.grid

    def compact(self) -> CompactGrid:
        """Packed, made once per change."""
        if self._compact is None:
            self._compact = CompactGrid.of(self.mapper.grid, self.mapper.field.facing)
        return self._compact

    def pack(self) -> None:
        """Give back the memory that only matching needs."""
        self.compact()
        self._mapper = None

    def insert(self, T_submap_base: SE2, cloud: PointScan) -> bool:
        """Insert a scan; False when the map would become too large."""
        try:
            self.mapper.insert(T_submap_base, cloud.points, cloud.origins)
        except MapTooLargeError:
            return False
        self._compact = None
        self.scans += 1
        return True

    def keep(self, keyframe: Keyframe) -> None:
        """Keep a scan."""
        place = keyframe.T_submap_base.as_array()
        if keyframe.widens:
            self.travelled += float(np.hypot(*(place - self._centres[-1])[:2])) if len(self._centres) else 0.0
            self._centres = np.vstack([self._centres, place])
        self.keyframes.append(keyframe)
        self._places = np.vstack([self._places, place])

    def is_new(self, T_submap_base: SE2, gate: KeyframeGate) -> bool:
        """Whether no kept scan lies within the gate of a pose."""
        turn = np.abs(np.remainder(self._places[:, 2] - T_submap_base.yaw + np.pi, 2.0 * np.pi) - np.pi)
        return not bool(np.any((_distances(self._places, T_submap_base) < gate.distance) & (turn < gate.yaw)))

    def outside(self, T_submap_base: SE2) -> float:
        """Distance to the nearest kept scan that widens the submap [m]; inf without one."""
        return float(_distances(self._centres, T_submap_base).min(initial=np.inf))

    def in_sight(self, T_submap_base: SE2, reach: float) -> bool:
        """Whether a kept scan from within `reach` [m] sees a place, with no wall between."""
        kept = self._places[_distances(self._places, T_submap_base) < reach, :2]
        here = self.surfaces.pose_in_grid(T_submap_base)
        origins = np.repeat(np.array([[here.x, here.y]]), len(kept), axis=0)
        return not bool(sight.pierced(origins, self.surfaces.T_grid_map.transform(kept), self.surfaces.arrays).all())

    def agreement(self, T_submap_base: SE2, cloud: PointScan) -> Agreement:
        """How a scan fits the map."""
        points = cloud.points
        if len(points) == 0:
            return Agreement(0.0, 0.0, 0.0)
        geometry = self.grid.geometry
        cells = geometry.to_cells(T_submap_base.transform(points))
        T_grid_base = self.surfaces.pose_in_grid(T_submap_base)
        behind = sight.from_behind(T_grid_base.transform(cloud.origins), T_grid_base.transform(points), self.surfaces.arrays, NEAR)
        cells = cells[geometry.contains(cells)]
        log_odds = self.grid.log_odds[cells[:, 0], cells[:, 1]]
        squares = self.surfaces.squares[cells[:, 0], cells[:, 1]]
        known = (log_odds != 0.0) | (squares <= 4)
        astray = (log_odds < FREE) & (squares > (NEAR / geometry.resolution) ** 2)
        return Agreement(*(float(which.sum()) / len(points) for which in (known, astray, behind)))


def _distances(places: FloatArray, pose: SE2) -> FloatArray:
    return np.hypot(places[:, 0] - pose.x, places[:, 1] - pose.y)
