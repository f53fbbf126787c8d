"""Where the robot may go: a map with room kept around everything that stands in it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from slam.errors import require_not_negative, require_positive
from slam.grid import FREE, OCCUPIED, UNKNOWN, GridGeometry, OccupancyGrid
from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray

SURELY_FREE = -0.5
"""Log-odds at which a cell counts as free: three beams went through."""
SPECK = 4
"""Unknown areas of fewer cells are the noise of the map."""
NOWHERE: FloatArray = np.empty((0, 2))


@dataclass(frozen=True, slots=True)
class Inflation:
    """The room that a robot keeps; after the inflation layer of ROS's costmap_2d, with a cost that falls as a square."""

    radius: float = 0.13
    """Of the circle about `base` that holds the robot [m]."""
    margin: float = 0.03
    """Kept beside it: what pose and path are wrong by [m]."""
    comfort: float = 0.45
    """Room beyond which a way costs no more than its length [m]."""
    weight: float = 4.0
    """Extra cost where the robot barely fits, as a multiple of the way's length."""
    unknown: float = math.inf
    """What a metre of way through the unknown costs; inf: the robot never goes there."""
    driven: float = 0.20
    """About a place where the robot has been nothing is unknown [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "radius", "comfort")
        require_not_negative(self, "margin", "weight", "driven")

    @property
    def tight(self) -> float:
        """Least room about `base` [m]."""
        return self.radius + self.margin


@dataclass(frozen=True, slots=True, eq=False)
class Costmap:
    """Made anew when the map has changed: a map that is corrected moves."""

    geometry: GridGeometry
    states: NDArray[np.int8]
    """(H, W) of 100 occupied, 0 free, -1 unknown, without what the live scan sees."""
    room: FloatArray
    """(H, W) from the middle of each cell to the nearest obstacle [m]."""
    costs: NDArray[np.float32]
    """(H, W) of a metre of way; inf where the robot does not fit or may meet what is unknown."""
    inflation: Inflation = field(default_factory=Inflation)

    @classmethod
    def of(
        cls,
        grid: OccupancyGrid,
        inflation: Inflation,
        places: Trajectory | None = None,
        obstacles: FloatArray = NOWHERE,
        goal: tuple[float, float] | None = None,
    ) -> Costmap:
        """Lay room around a map.

        Args:
            grid: the map.
            inflation: how much room.
            places: where the robot has been in the map; what lay under it is free.
            obstacles: (N, 2) hits of the live scan in the map [m]: people, a door that has closed.
            goal: place [m] that the costmap must hold if there are ways through the unknown.
        """
        geometry, states = grid.geometry, states_of(grid)
        if goal is not None and math.isfinite(inflation.unknown):
            geometry, states = _widened(geometry, states, goal)
        _clear(states, geometry, NOWHERE if places is None else places.poses[:, :2], inflation.driven)
        solid = states == OCCUPIED
        cells = geometry.to_cells(obstacles)
        cells = cells[geometry.contains(cells)]
        solid[cells[:, 0], cells[:, 1]] = True
        half = 0.5 * geometry.resolution
        room = _distances(solid) * geometry.resolution - half
        from_unknown = _distances(states == UNKNOWN) * geometry.resolution - half
        return cls(geometry, states, room, _costs(room, from_unknown, inflation), inflation)

    def flat_cell(self, point: tuple[float, float]) -> int:
        """Flat cell that holds a point [m]; -1 outside the map."""
        cell = self.geometry.to_cells(np.array([point]))
        return int(cell[0, 0]) * self.geometry.width + int(cell[0, 1]) if self.geometry.contains(cell)[0] else -1

    def room_at(self, points: FloatArray) -> FloatArray:
        """Room (N,) [m] about points (N, 2) [m]; 0 outside the map."""
        return self._at(self.room, points, 0.0)

    def costs_at(self, points: FloatArray) -> FloatArray:
        """Costs (N,) at points (N, 2) [m]; inf outside the map."""
        return self._at(self.costs, points, np.inf)

    def _at(self, values: NDArray[np.float32] | FloatArray, points: FloatArray, outside: float) -> FloatArray:
        cells = self.geometry.to_cells(points)
        inside = self.geometry.contains(cells)
        found = np.full(len(points), outside)
        found[inside] = values[cells[inside, 0], cells[inside, 1]]
        return found


def states_of(grid: OccupancyGrid) -> NDArray[np.int8]:
    """100, 0, -1 (H, W) as a robot should take a map: rather occupied than free is occupied, little known is unknown.

    A cell that was hit and is no more likely than not is the blurred edge of a wall: it is free, not unknown. Specks of unknown are free.
    """
    states = np.full(grid.log_odds.shape, UNKNOWN, np.int8)
    states[(grid.log_odds <= SURELY_FREE) | ((grid.hit_count > 0.0) & (grid.log_odds < 0.0))] = FREE
    states[grid.likely()] = OCCUPIED
    areas, count = ndimage.label(states == UNKNOWN)
    if count:
        small = np.bincount(areas.ravel()) < SPECK
        small[0] = False
        states[small[areas]] = FREE
    return states


def _widened(geometry: GridGeometry, states: NDArray[np.int8], goal: tuple[float, float]) -> tuple[GridGeometry, NDArray[np.int8]]:
    """The map with a metre of the unknown beyond a goal outside it, and about itself."""
    row, col = geometry.to_cells(np.array([goal]))[0].tolist()
    if 0 <= row < geometry.height and 0 <= col < geometry.width:
        return geometry, states
    beside = round(1.0 / geometry.resolution)
    below, left = max(-row, 0) + beside, max(-col, 0) + beside
    above, right = max(row - geometry.height, 0) + beside, max(col - geometry.width, 0) + beside
    corner = geometry.T_map_grid @ SE2(-left * geometry.resolution, -below * geometry.resolution)
    wide = GridGeometry(geometry.resolution, geometry.width + left + right, geometry.height + below + above, corner)
    return wide, np.pad(states, ((below, above), (left, right)), constant_values=UNKNOWN)


def _clear(states: NDArray[np.int8], geometry: GridGeometry, places: FloatArray, radius: float) -> None:
    """Free what is unknown about places (N, 2) [m]."""
    cells = np.unique(geometry.to_cells(places), axis=0)
    reach = int(radius / geometry.resolution)
    rows, cols = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    disc = np.argwhere(rows**2 + cols**2 <= (radius / geometry.resolution) ** 2) - reach
    around = (cells[:, None] + disc).reshape(-1, 2)
    around = around[geometry.contains(around)]
    rows, cols = around.T
    unknown = states[rows, cols] == UNKNOWN
    states[rows[unknown], cols[unknown]] = FREE


def _distances(mask: NDArray[np.bool_]) -> FloatArray:
    """To the nearest cell of a mask [cells]; inf where there is none."""
    return ndimage.distance_transform_edt(~mask) if mask.any() else np.full(mask.shape, np.inf)


def _costs(room: FloatArray, from_unknown: FloatArray, inflation: Inflation) -> NDArray[np.float32]:
    short = np.clip((inflation.comfort - room) / max(inflation.comfort - inflation.tight, 1e-6), 0.0, 1.0)
    costs = 1.0 + inflation.weight * short**2
    costs[from_unknown < inflation.radius] *= inflation.unknown
    costs[room < inflation.tight] = np.inf
    return costs.astype(np.float32)
