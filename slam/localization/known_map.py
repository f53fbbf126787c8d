"""A finished map, as localizers use it: what is derived from it is made once, when it is first asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slam.errors import KnownMapError
from slam.grid import FREE, OccupancyGrid
from slam.kernels.facing import facing_of
from slam.matching.surface_field import SurfaceField
from slam.se2 import FloatArray


@dataclass(frozen=True, eq=False)
class KnownMap:
    """A map that does not change while the robot is localised in it.

    Raises:
        KnownMapError: it has no wall, or no room to be in.
    """

    grid: OccupancyGrid

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
    def field(self) -> SurfaceField:
        """Nearest surfaces, each facing the free space beside it: the two sides of a thin wall are told apart."""
        return SurfaceField(self.grid, facing=facing_of(self.grid.likely(), self.grid.states() == FREE))
