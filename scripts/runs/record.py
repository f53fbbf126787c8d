"""All that is known of a finished run: what its metrics and pictures are made of."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scripts.runs.marker_views import MarkerView
from slam.evaluation.visibility import View
from slam.grid import GridGeometry, OccupancyGrid
from slam.messages import Status, Trajectory
from slam.navigation.outcome import Outcome
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
    particles: FloatArray = field(default_factory=lambda: np.empty((0, 4)))
    """(N, 4) of x, y [m], yaw [rad], weight in the map; thinned."""
    localizability: FloatArray = field(default_factory=lambda: np.zeros((3, 3)))
    """D of the scan, see `Snapshot`."""
    markers: MarkerView | None = None
    """What the camera saw of markers."""


@dataclass(frozen=True, slots=True, eq=False)
class ParticleHistory:
    """How a particle filter's belief went, at stamps [s]."""

    stamps: FloatArray = field(default_factory=lambda: np.empty(0))
    """(K,) [s]"""
    count: FloatArray = field(default_factory=lambda: np.empty(0))
    """(K,) particles."""
    effective: FloatArray = field(default_factory=lambda: np.empty(0))
    """(K,) N_eff = 1 / sum w^2."""
    largest: FloatArray = field(default_factory=lambda: np.empty(0))
    """(K,) the largest weight, times the number of particles: 1 when all are equal."""
    spread: FloatArray = field(default_factory=lambda: np.empty(0))
    """(K,) weighted standard deviation of the positions [m]."""

    @classmethod
    def of(cls, rows: Sequence[tuple[float, float, float, float, float]]) -> ParticleHistory:
        """From one row of the fields at each stamp."""
        return cls(*np.array(rows, dtype=np.float64).reshape(-1, 5).T)


def belief_row(stamp: float, particles: FloatArray) -> tuple[float, float, float, float, float]:
    """A row of `ParticleHistory` from particles (N, 4) of x, y [m], yaw [rad], weight."""
    weights = particles[:, 3] / particles[:, 3].sum()
    off = particles[:, :2] - np.sum(weights[:, None] * particles[:, :2], axis=0)
    spread = math.sqrt(float(np.sum(weights * np.sum(off**2, axis=1))))
    return stamp, float(len(weights)), 1.0 / float(np.sum(weights**2)), float(weights.max()) * len(weights), spread


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
    beliefs: ParticleHistory = field(default_factory=ParticleHistory)
    """Empty when the pipeline has no particles."""
    view: View = field(default_factory=View)
    T_base_laser: SE2 = field(default_factory=SE2)
    T_world_map: SE2 | None = None
    """Where a map that was given lies in the world; None: estimates are scored after alignment."""
    outcome: Outcome | None = None
    """How the drive of a policy ended that has an end."""
    true_map: OccupancyGrid | None = None
    collisions: int | None = None
    """How often a twin has begun to touch something."""
    robot_radius: float = 0.13
    """[m]"""
    metrics: Mapping[str, float] = field(default_factory=dict)
