"""Record once, run every estimator on the same frames, score them by the same rule: what experiments and comparisons share."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scripts.experiments.drive import Course, Drive
from scripts.runs.known_map import GivenMap
from scripts.runs.metrics import aligned_errors
from slam.evaluation.poses import wrap_angles
from slam.evaluation.trajectory import interpolate_truth
from slam.localization.known_map import KnownMap
from slam.mapping.lidar_slam import LidarSlam
from slam.messages import Estimate, SensorFrame, Status, Trajectory
from slam.pipelines import Finishing, Pipeline
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot

Watch = Callable[[SensorFrame, Estimate, Snapshot], None]
"""Told every frame, its answer, and what the pipeline knows then."""


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What one estimator made of a drive, in its map's frame."""

    estimate: Trajectory
    """`T_map_base` as it was known, at every frame."""
    final: Trajectory
    """After all corrections, at every scan."""
    statuses: tuple[Status, ...]
    """One per frame."""
    update_ms: FloatArray
    """(N,) CPU time of each update that had a scan or an image [ms]."""
    covariances: FloatArray
    """(N, 3, 3) of (x, y, yaw) in the map as claimed at every frame [m, rad]: of a particle filter the spread of its particles."""


@dataclass(frozen=True, slots=True, eq=False)
class WorldErrors:
    """Signed errors (N,) in the world's axes [m, rad], at stamps [s]."""

    stamps: FloatArray
    x: FloatArray
    y: FloatArray
    yaw: FloatArray

    @property
    def position(self) -> FloatArray:
        """Distances (N,) [m]."""
        return np.hypot(self.x, self.y)

    def where(self, chosen: FloatArray) -> WorldErrors:
        """Those chosen by a mask (N,)."""
        return WorldErrors(self.stamps[chosen], self.x[chosen], self.y[chosen], self.yaw[chosen])


def rmse(values: FloatArray) -> float:
    """Root mean square; nan of nothing."""
    return math.sqrt(float(np.mean(np.square(values)))) if len(values) else math.nan


def mae(values: FloatArray) -> float:
    """Mean absolute value; nan of nothing."""
    return float(np.mean(np.abs(values))) if len(values) else math.nan


def follow(pipeline: Pipeline, drive: Drive, watch: Watch | None = None) -> Outcome:
    """Give the frames to a pipeline, one after the other."""
    stamps: list[float] = []
    poses: list[FloatArray] = []
    statuses: list[Status] = []
    updates: list[float] = []
    covariances: list[FloatArray] = []
    for frame in drive.frames:
        began = time.thread_time()
        estimate = pipeline.update(frame)
        if frame.scans or frame.images:
            updates.append(1e3 * (time.thread_time() - began))
        stamps.append(estimate.stamp)
        poses.append(estimate.T_map_base.as_array())
        statuses.append(estimate.status)
        covariances.append(estimate.covariance)
        if watch is not None:
            watch(frame, estimate, pipeline.snapshot())
    if isinstance(pipeline, Finishing):
        pipeline.finish()
    path = Trajectory(np.array(stamps), np.array(poses).reshape(-1, 3))
    return Outcome(path, pipeline.snapshot().trajectory, tuple(statuses), np.array(updates), np.array(covariances).reshape(-1, 3, 3))


def map_of(drive: Drive, pipeline: Pipeline | None = None) -> GivenMap:
    """The map that `lidar_slam`, or another mapping pipeline, makes of a drive, and where it lies in the world."""
    mapper = pipeline or LidarSlam().build()
    final = follow(mapper, drive).final
    return GivenMap(KnownMap(mapper.snapshot().map), aligned_errors(drive.truth, final).T_truth_estimate)


def mapped(world: str, duration: float, seed: int = 0) -> GivenMap:
    """The map of a world from a tour of its own, as everybody would make it before localising in it."""
    return map_of(Course(world, duration, seed).drive())


def start_in(given: GivenMap, drive: Drive) -> SE2:
    """The true `T_map_base` at the first frame."""
    return given.T_world_map.inverse() @ drive.start


def errors_in(given: GivenMap, drive: Drive, estimate: Trajectory) -> WorldErrors:
    """Errors of a localizer without alignment: its map lies where the run that made it was scored."""
    truth, estimate = interpolate_truth(drive.truth, estimate)
    poses = np.array([(given.T_world_map @ SE2.from_array(pose)).as_array() for pose in estimate.poses]).reshape(-1, 3)
    off = poses - truth.poses
    return WorldErrors(truth.stamps, off[:, 0], off[:, 1], wrap_angles(off[:, 2]))
