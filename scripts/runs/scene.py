"""A run laid out in one frame: the world where the truth is known, else the map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scripts.runs.metrics import place_of_map
from scripts.runs.record import RunRecord
from slam.evaluation.poses import sample, transform
from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray

MARGIN = 0.04
"""Of the larger side, around all that is shown."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Trajectories and walls in one frame. The odometry starts where the estimate starts, so that its drift shows."""

    T_world_map: SE2
    estimate: Trajectory
    odometry: Trajectory
    truth: Trajectory | None
    walls: FloatArray
    """(M, 4) [m]; empty when unknown."""
    bounds: tuple[float, float, float, float]
    """x_min, x_max, y_min, y_max of what is worth showing [m]."""


def lay_out(record: RunRecord) -> Scene:
    """Bring a run into one frame.

    Raises:
        TrajectoryError: truth and estimate do not overlap in time.
    """
    T_world_map = SE2() if record.truth is None or len(record.estimate) == 0 else place_of_map(record, record.truth)
    estimate = _moved(T_world_map, record.estimate)
    walls = np.empty((0, 4)) if record.walls is None else record.walls
    return Scene(
        T_world_map,
        estimate,
        _moved(T_world_map @ start_of_odometry(record), record.odometry),
        record.truth,
        walls,
        _bounds(T_world_map.transform(record.map.wall_points()), estimate.poses[:, :2], walls.reshape(-1, 2)),
    )


def start_of_odometry(record: RunRecord) -> SE2:
    """`T_map_odom` that makes odometry and estimate agree at the first frame."""
    if len(record.estimate) == 0 or len(record.odometry) == 0:
        return SE2()
    T_odom_base = SE2.from_array(sample(record.odometry, record.estimate.stamps[:1])[0])
    return SE2.from_array(record.estimate.poses[0]) @ T_odom_base.inverse()


def _moved(T_world_frame: SE2, trajectory: Trajectory) -> Trajectory:
    return Trajectory(trajectory.stamps, transform(T_world_frame, trajectory.poses))


def _bounds(*points: FloatArray) -> tuple[float, float, float, float]:
    everything = np.concatenate([*points, np.zeros((0, 2))])
    if len(everything) == 0:
        return -1.0, 1.0, -1.0, 1.0
    low, high = everything.min(axis=0), everything.max(axis=0)
    margin = MARGIN * max(float(np.max(high - low)), 1.0)
    (x_min, y_min), (x_max, y_max) = (low - margin).tolist(), (high + margin).tolist()
    return x_min, x_max, y_min, y_max
