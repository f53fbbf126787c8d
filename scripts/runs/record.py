"""All that is known of a finished run: what its metrics and pictures are made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from slam.evaluation.visibility import View
from slam.grid import GridGeometry, OccupancyGrid
from slam.messages import Status, Trajectory
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class KeyFrame:
    """One moment of the run, for the animation."""

    stamp: float
    T_map_base: SE2
    geometry: GridGeometry
    states: NDArray[np.int8]
    """(height, width) of 100 occupied, 0 free, -1 unknown: the map so far."""
    points: FloatArray
    """(K, 2) hits of the current scan in the map [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class RunRecord:
    """A finished run. Without ground truth `truth` is None; `walls` may be known only with it."""

    title: str
    estimate: Trajectory
    """`T_map_base` as it was known, at every frame."""
    final: Trajectory
    """`T_map_base` at every scan, after all corrections."""
    odometry: Trajectory
    """`T_odom_base`."""
    map: OccupancyGrid
    truth: Trajectory | None = None
    """`T_world_base`."""
    walls: FloatArray | None = None
    """(M, 4) true walls at the height of the lidar in the world: x1, y1, x2, y2 [m]."""
    statuses: tuple[Status, ...] = ()
    """One per frame."""
    key_frames: tuple[KeyFrame, ...] = ()
    view: View = field(default_factory=View)
    T_base_laser: SE2 = field(default_factory=SE2)
    T_world_map: SE2 | None = None
    """Where a map that was given lies in the world; None: estimates are scored after alignment."""
    metrics: Mapping[str, float] = field(default_factory=dict)
