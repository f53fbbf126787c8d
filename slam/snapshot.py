"""What a pipeline knows at one moment, for policies, reports, recordings and views."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slam.grid import OccupancyGrid
from slam.messages import Trajectory
from slam.se2 import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """A frozen view of a pipeline's knowledge."""

    map: OccupancyGrid
    """Read-only copy of the map so far."""
    trajectory: Trajectory
    """`T_map_base` at every scan, with all corrections so far."""
    particles: FloatArray = field(default_factory=lambda: np.empty((0, 4)))
    """(N, 4) of x, y [m], yaw [rad], weight: what a particle filter believes, in the map."""
    localizability: FloatArray = field(default_factory=lambda: np.zeros((3, 3)))
    """D (3, 3) of (x, y, yaw) in the map [1/m^2, 1/rad^2]: what the newest scan alone tells of the pose; 0 where nobody asked."""
