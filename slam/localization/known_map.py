"""A finished map, as localizers use it: what is derived from it is made once, when it is first asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from slam.errors import KnownMapError
from slam.grid import FREE, OccupancyGrid
from slam.localization.panoramas import Panoramas
from slam.localization.wall_faces import faced
from slam.matching.surface_field import SurfaceField
from slam.se2 import SE2, FloatArray

BESIDE = 0.1
"""A point so near to a wall, along rows and columns, may be of it [m]."""


@dataclass(frozen=True, eq=False)
class KnownMap:
    """A map that does not change while the robot is localised in it.

    Raises:
        KnownMapError: it has no wall, or no room to be in.
    """

    grid: OccupancyGrid
    file: Path | None = None
    """The YAML that it was read from, beside which may be kept what takes long to derive."""

    def __post_init__(self) -> None:
        if not self.grid.occupied().any():
            raise KnownMapError("it has no occupied cell: nothing that a scan could be compared with")
        if len(self.free_cells) == 0:
            raise KnownMapError("it has no free cell: there is no place where the robot could be")

    @cached_property
    def free_cells(self) -> NDArray[np.int64]:
        """(K, 2) cells (row, col) that are known to be free."""
        return np.argwhere(self.grid.states() == FREE)

    @cached_property
    def free_points(self) -> FloatArray:
        """(K, 2) their centres in the map [m]."""
        return self.grid.geometry.to_points(self.free_cells)

    @cached_property
    def beside_walls(self) -> NDArray[np.bool_]:
        """(H, W) cells that are at most `BESIDE` from a wall."""
        reach = max(1, round(BESIDE / self.grid.geometry.resolution))
        return np.asarray(binary_dilation(self.grid.likely(), np.ones((2 * reach + 1, 2 * reach + 1), np.bool_)), np.bool_)

    def share_on_walls(self, T_map_base: SE2, points: FloatArray) -> float:
        """Share of points (M, 2) in base that lie beside a wall; 0 of none."""
        geometry = self.grid.geometry
        cells = np.floor((geometry.T_map_grid.inverse() @ T_map_base).transform(points) / geometry.resolution).astype(np.int64)[:, ::-1]
        inside = ((cells >= 0) & (cells < (geometry.height, geometry.width))).all(axis=1)
        return float(self.beside_walls[tuple(cells[inside].T)].sum()) / max(len(points), 1)

    @cached_property
    def field(self) -> SurfaceField:
        """Nearest surfaces, each facing the free space beside it: the two sides of a thin wall are told apart."""
        grid, facing = faced(self.grid)
        return SurfaceField(grid, facing=facing)

    @cached_property
    def panoramas(self) -> Panoramas:
        """What a lidar would see from everywhere."""
        return Panoramas.of(self.grid)
