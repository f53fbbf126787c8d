"""What a pipeline knows at one moment, for policies, reports, recordings and views."""

from __future__ import annotations

from dataclasses import dataclass

from slam.grid import OccupancyGrid
from slam.messages import Trajectory


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """A frozen view of a pipeline's knowledge."""

    map: OccupancyGrid
    """Read-only copy of the map so far."""
    trajectory: Trajectory
    """`T_map_base` at every scan, with all corrections so far."""
