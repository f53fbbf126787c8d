"""The figures of a run, as `metrics.json` keeps them. A figure that cannot be known is absent."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scripts.runs.record import RunRecord
from slam.evaluation.coverage import coverage, reachable_area
from slam.evaluation.maps import iou, wall_recall, wall_rms
from slam.evaluation.poses import compose
from slam.evaluation.trajectory import PoseErrors, Statistics, absolute_errors, align, interpolate_truth
from slam.evaluation.visibility import visible_walls
from slam.messages import Status, Trajectory
from slam.se2 import SE2, FloatArray

PLACE_OF_MAP = ("T_world_map_x_m", "T_world_map_y_m", "T_world_map_yaw_rad")
"""Where the map of a run lies in the world: who is localised in it is scored by this."""


KEPT_FREE = 0.07
"""What a robot keeps free beside itself where its reachable area is told [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Timing:
    """Wall time that a run took."""

    updates: FloatArray
    """(N,) of each pipeline update [s]."""
    total: float
    """Of the whole loop [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class AlignedErrors:
    """Errors of a trajectory after SE(2) alignment without scale, or where its map is known to lie."""

    stamps: FloatArray
    """(N,) [s]"""
    errors: PoseErrors
    T_truth_estimate: SE2


def aligned_errors(truth: Trajectory, estimate: Trajectory, T_truth_estimate: SE2 | None = None) -> AlignedErrors:
    """Errors at every estimate that the truth covers; aligned to it when its frame is not known.

    Raises:
        TrajectoryError: the truth covers none.
    """
    paired_truth, paired_estimate = interpolate_truth(truth, estimate)
    if T_truth_estimate is None:
        T_truth_estimate = align(paired_truth, paired_estimate)
    return AlignedErrors(paired_truth.stamps, absolute_errors(paired_truth, paired_estimate, T_truth_estimate), T_truth_estimate)


def place_of_map(record: RunRecord, truth: Trajectory) -> SE2:
    """`T_world_map`: as it is known, else by aligning the corrected trajectory.

    Raises:
        TrajectoryError: truth and estimate do not overlap in time.
    """
    if record.T_world_map is not None:
        return record.T_world_map
    return aligned_errors(truth, record.final if len(record.final) > 0 else record.estimate).T_truth_estimate


def compute_metrics(record: RunRecord, timing: Timing) -> dict[str, float]:
    """The design's keys and those of issue 2; without truth those that need none.

    Raises:
        TrajectoryError: truth and estimate do not overlap in time.
    """
    metrics = _progress(record, timing)
    if record.truth is not None and len(record.estimate) > 0:
        metrics |= _pose_metrics(record, record.truth) | _drive_metrics(record, record.truth)
        if record.walls is not None:
            metrics |= _map_metrics(record, record.truth, record.walls)
    return {key: value for key, value in metrics.items() if math.isfinite(value)}


def _progress(record: RunRecord, timing: Timing) -> dict[str, float]:
    stamps, updates = record.estimate.stamps, timing.updates * 1e3
    metrics: dict[str, float] = {
        "frames": len(stamps),
        "frames_degraded": record.statuses.count(Status.DEGRADED),
        "frames_lost": record.statuses.count(Status.LOST),
    }
    if len(stamps) > 0 and timing.total > 0.0:
        metrics["real_time_factor"] = float(stamps[-1] - stamps[0]) / timing.total
    if len(updates) > 0:
        metrics["update_ms_median"], metrics["update_ms_p99"] = (float(value) for value in np.percentile(updates, [50, 99]))
    return metrics


def _pose_metrics(record: RunRecord, truth: Trajectory) -> dict[str, float]:
    scored = aligned_errors(truth, record.estimate, record.T_world_map).errors
    position = Statistics.of(scored.translation)
    metrics = {
        "position_rmse_m": position.rmse,
        "position_max_m": position.max,
        "heading_rmse_deg": math.degrees(Statistics.of(scored.heading).rmse),
    }
    if len(record.odometry) > 0:
        floor = aligned_errors(truth, record.odometry).errors
        metrics["odometry_position_rmse_m"] = Statistics.of(floor.translation).rmse
        metrics["odometry_heading_rmse_deg"] = math.degrees(Statistics.of(floor.heading).rmse)
        if position.rmse > 0.0:
            metrics["odometry_ratio"] = metrics["odometry_position_rmse_m"] / position.rmse
    return metrics


def _drive_metrics(record: RunRecord, truth: Trajectory) -> dict[str, float]:
    """What a policy that explores is judged by."""
    metrics = {} if record.collisions is None else {"collisions": float(record.collisions)}
    if record.true_map is not None:
        start = float(truth.poses[0, 0]), float(truth.poses[0, 1])
        area = reachable_area(record.true_map, start, record.robot_radius + KEPT_FREE, record.view.range_max)
        metrics["coverage"] = coverage(record.map, record.true_map, area, place_of_map(record, truth))
        metrics["path_m"] = float(np.hypot(*np.diff(truth.poses[:, :2], axis=0).T).sum())
    return metrics


def _map_metrics(record: RunRecord, truth: Trajectory, walls: FloatArray) -> dict[str, float]:
    T_world_map = place_of_map(record, truth)
    laser = compose(truth.poses, np.tile(record.T_base_laser.as_array(), (len(truth), 1)))
    visible = visible_walls(walls, laser, record.view)
    return {
        "wall_rms_m": wall_rms(record.map, walls, T_world_map),
        "wall_recall": wall_recall(record.map, visible, T_world_map),
        "iou": iou(record.map, walls, visible, T_world_map),
        **dict(zip(PLACE_OF_MAP, T_world_map.as_array().tolist(), strict=True)),
    }
