"""Relation error of R. Kuemmerle et al., "On measuring the accuracy of SLAM algorithms" (2009), Autonomous Robots 27(4)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slam.errors import TrajectoryError
from slam.evaluation.poses import bracket, compose, relative, sample, wrap_angles
from slam.messages import Trajectory
from slam.se2 import FloatArray
from slam.table_file import read_table

COLUMNS = "t_i t_j x y z roll pitch yaw"


@dataclass(frozen=True, slots=True, eq=False)
class Relations:
    """True relative poses between moments of a log, in the plane."""

    stamps: FloatArray
    """(N, 2) of t_i, t_j [s] in the log's time."""
    poses: FloatArray
    """(N, 3) pose of j in the frame of i: x, y [m], yaw [rad]."""


@dataclass(frozen=True, slots=True)
class RelationError:
    """Mean and standard deviation of the absolute errors over all relations."""

    translation_mean: float
    """[m]"""
    translation_std: float
    """[m]"""
    rotation_mean: float
    """[rad]"""
    rotation_std: float
    """[rad]"""
    count: int


def read_relations(path: Path) -> Relations:
    """Read lines `t_i t_j x y z roll pitch yaw`.

    Raises:
        TrajectoryError: the file cannot be read, is empty, or a line does not hold eight finite numbers.
    """
    rows = read_table(path, COLUMNS)
    if len(rows) == 0:
        raise TrajectoryError(f"{path}: holds no relation; its lines must be '{COLUMNS}'")
    return Relations(rows[:, :2], rows[:, [2, 3, 7]])


def relation_error(estimate: Trajectory, odometry: Trajectory, relations: Relations) -> RelationError:
    """Absolute error of the estimated relative poses, the paper's metric with absolute in place of squared differences.

    Args:
        estimate: `T_map_base` at the scans.
        odometry: `T_odom_base`, dense; it carries the pose on where relations end between scans. It should hold the scans'
            own odometry too: where a log's stamps crowd, interpolating it costs centimetres (13 mm in the mean on intel.log).
        relations: the truth, stamps in the same time.

    Raises:
        TrajectoryError: a trajectory is empty or its stamps run back.
    """
    T_map_i, T_map_j = (_pose_at(estimate, odometry, stamps) for stamps in relations.stamps.T)
    estimated = relative(T_map_i, T_map_j)
    translation = np.hypot(*(estimated - relations.poses)[:, :2].T)
    rotation = np.abs(wrap_angles(estimated[:, 2] - relations.poses[:, 2]))
    return RelationError(
        float(translation.mean()), float(translation.std()), float(rotation.mean()), float(rotation.std()), len(relations.poses)
    )


def _pose_at(estimate: Trajectory, odometry: Trajectory, stamps: FloatArray) -> FloatArray:
    """Poses (N, 3): odometry carries on from the scans before and after, blended linearly in time; beyond the ends from the nearest."""
    before, fraction = bracket(estimate, stamps)
    after = np.minimum(before + 1, len(estimate) - 1)
    T_odom_base = sample(odometry, stamps)
    T_odom_scan = sample(odometry, estimate.stamps)
    onward = compose(estimate.poses[before], relative(T_odom_scan[before], T_odom_base))
    backward = compose(estimate.poses[after], relative(T_odom_scan[after], T_odom_base))
    difference = backward - onward
    difference[:, 2] = wrap_angles(difference[:, 2])
    blended = onward + fraction[:, None] * difference
    blended[:, 2] = wrap_angles(blended[:, 2])
    return blended
