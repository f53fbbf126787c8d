"""A world made ready for exploring: where the map lies in it, what stops the robot, and how much of it can be seen at all."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from hardware.spec import LidarSpec, RobotSpec
from sim.envs import area_kernel
from sim.envs.map_kernel import CELL, HALF, SIDE
from sim.errors import SimError
from sim.unicycle import obstacles
from slam.se2 import SE2, FloatArray
from worlds.loader import load_world
from worlds.world import World

MARGIN = 0.02
"""Added to the robot's radius for the places that count as reachable [m]."""
LATTICE = 4
"""Cells between two places that are looked from."""
RAYS = 360
"""Directions that are looked in from each."""
SITES_KEPT = 128


@dataclass(frozen=True, slots=True, eq=False)
class Site:
    """One world, seen from where the robot starts: that pose is the map's origin."""

    text: str
    """What `load_world` takes."""
    world: World
    T_world_map: SE2
    walls: tuple[FloatArray, FloatArray]
    """Sides (N, 4) [m] in the world of what stops the robot, and hulls (M, 5), see `outline_kernel.clearance_of`."""
    area: NDArray[np.uint8]
    """(H, W) 1 for every cell that counts: free, and visible within the lidar's reach from a place that the robot gets to."""
    corner: tuple[int, int]
    """Row and column of the map's cell in which `area` begins."""

    @property
    def cells(self) -> int:
        """How many cells count."""
        return int(self.area.sum())

    def counting(self) -> NDArray[np.uint8]:
        """`area` in a map (SIDE, SIDE)."""
        mask = np.zeros((SIDE, SIDE), np.uint8)
        self.mark(mask)
        return mask

    def mark(self, mask: NDArray[np.uint8]) -> None:
        """Write `area` into a map (SIDE, SIDE)."""
        mask[:] = 0
        (row, col), (height, width) = self.corner, self.area.shape
        mask[row : row + height, col : col + width] = self.area


@functools.lru_cache(maxsize=SITES_KEPT)
def site_of(text: str) -> Site:
    """The site of a world by name; kept, for episodes come back to it.

    Raises:
        WorldError: there is no such world, or it cannot be read.
        SimError: it is too large for the map, or leaves the robot no place.
    """
    world = load_world(text)
    T_world_map = SE2(*world.start)
    area, corner = _area(world, T_world_map)
    return Site(text, world, T_world_map, obstacles(world), area, corner)


def _area(world: World, T_world_map: SE2) -> tuple[NDArray[np.uint8], tuple[int, int]]:
    spec = RobotSpec()
    lidar = spec.lidar or LidarSpec()
    seen_from = world.outlines(float(lidar.T_base_laser.t[2]))
    ends = np.vstack([seen_from, obstacles(world)[0]]).reshape(-1, 2)
    points = T_world_map.inverse().transform(ends) / CELL + HALF
    low, high = np.floor(points.min(axis=0)).astype(np.int64) - 1, np.floor(points.max(axis=0)).astype(np.int64) + 2
    if low.min() < 0 or high.max() > SIDE:
        raise SimError(f"world {world.name} reaches farther than {0.5 * SIDE * CELL:.1f} m from the robot's start; take a smaller one")
    segments = (points - low).reshape(-1, 4)
    opaque, solid = (np.zeros((high - low)[::-1], np.uint8) for _ in range(2))
    area_kernel.outline_cells(opaque, segments[: len(seen_from)])
    area_kernel.outline_cells(solid, segments)
    wide = ndimage.distance_transform_edt(solid == 0) * CELL >= spec.radius + MARGIN
    labels, _ = ndimage.label(wide)
    home = (HALF - int(low[1]), HALF - int(low[0]))
    if not labels[home]:
        raise SimError(f"world {world.name} leaves the robot no room at its start {world.start}")
    places = np.argwhere(labels == labels[home])
    places = places[np.all(places % LATTICE == 0, axis=1)]
    return area_kernel.visible(opaque, places, math.ceil(lidar.range_max / CELL), RAYS), (int(low[1]), int(low[0]))
