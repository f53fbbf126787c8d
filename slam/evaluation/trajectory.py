"""Absolute and relative trajectory error of J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems" (IROS 2012)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.errors import TrajectoryError
from slam.evaluation.poses import nearest, relative, sample, transform, wrap_angles
from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray

STANDSTILL = 0.01
"""Positions that spread less than this [m, rms] do not determine a rotation."""


@dataclass(frozen=True, slots=True)
class Statistics:
    """Summary of absolute errors, in the errors' unit."""

    rmse: float
    mean: float
    median: float
    std: float
    max: float

    @classmethod
    def of(cls, errors: FloatArray) -> Statistics:
        """Summarise errors (N,), N >= 1."""
        rmse = float(np.sqrt(np.mean(errors**2)))
        return cls(rmse, float(np.mean(errors)), float(np.median(errors)), float(np.std(errors)), float(np.max(errors)))


@dataclass(frozen=True, slots=True, eq=False)
class PoseErrors:
    """Errors of N poses, or of N pairs of poses."""

    translation: FloatArray
    """(N,) [m], not negative"""
    heading: FloatArray
    """(N,) [rad], not negative"""


def associate(truth: Trajectory, estimate: Trajectory, max_difference: float = 0.01) -> tuple[Trajectory, Trajectory]:
    """Pair recorded poses: for each pose of the shorter trajectory the nearest in time of the longer, at most `max_difference` [s] away.

    Raises:
        TrajectoryError: no pair is that close.
    """
    if len(truth) < len(estimate):
        paired_estimate, paired_truth = associate(estimate, truth, max_difference)
        return paired_truth, paired_estimate
    index, difference = nearest(truth.stamps, estimate.stamps)
    near = difference <= max_difference
    _require(near, truth, estimate, max_difference)
    return Trajectory(truth.stamps[index[near]], truth.poses[index[near]]), Trajectory(estimate.stamps[near], estimate.poses[near])


def interpolate_truth(truth: Trajectory, estimate: Trajectory, max_difference: float = 0.05) -> tuple[Trajectory, Trajectory]:
    """Pair each estimate with the truth at its very stamp, where a sample of the truth is at most `max_difference` [s] away.

    Raises:
        TrajectoryError: no sample is that close.
    """
    _, difference = nearest(truth.stamps, estimate.stamps)
    near = difference <= max_difference
    _require(near, truth, estimate, max_difference)
    stamps = estimate.stamps[near]
    return Trajectory(stamps, sample(truth, stamps)), Trajectory(stamps, estimate.poses[near])


def align_points(source: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotation (D, D) and translation (D,) that bring points `source` (N, D) closest to `target` (N, D), without scale.

    S. Umeyama, "Least-squares estimation of transformation parameters between two point patterns" (PAMI 1991), equations 40 to 43.
    """
    source_mean, target_mean = source.mean(axis=0), target.mean(axis=0)
    U, _, Vt = np.linalg.svd((target - target_mean).T @ (source - source_mean))
    S = np.ones(source.shape[1])
    S[-1] = np.sign(np.linalg.det(U) * np.linalg.det(Vt))
    R = (U * S) @ Vt
    return R, target_mean - R @ source_mean


def align(truth: Trajectory, estimate: Trajectory) -> SE2:
    """`T_truth_estimate` that brings paired positions closest together; of a robot that stood still, mean position and mean heading."""
    source, target = estimate.poses[:, :2], truth.poses[:, :2]
    if min(_spread(source), _spread(target)) < STANDSTILL:
        turn = truth.poses[:, 2] - estimate.poses[:, 2]
        yaw = float(np.arctan2(np.sin(turn).mean(), np.cos(turn).mean()))
    else:
        R, _ = align_points(source, target)
        yaw = float(np.arctan2(R[1, 0], R[0, 0]))
    x, y = (target - SE2(yaw=yaw).transform(source)).mean(axis=0)
    return SE2(float(x), float(y), yaw)


def absolute_errors(truth: Trajectory, estimate: Trajectory, T_truth_estimate: SE2) -> PoseErrors:
    """Absolute trajectory error of paired poses, the estimate moved by `T_truth_estimate` (of `align`, or known)."""
    moved = transform(T_truth_estimate, estimate.poses)
    return _errors(moved, truth.poses)


def relative_errors(truth: Trajectory, estimate: Trajectory, pairs: NDArray[np.int64]) -> PoseErrors:
    """Relative pose error over `pairs` (M, 2) of indices into the paired trajectories."""
    i, j = pairs.T
    return _errors(relative(estimate.poses[i], estimate.poses[j]), relative(truth.poses[i], truth.poses[j]))


def pairs_by_frames(count: int, delta: int) -> NDArray[np.int64]:
    """Pairs (M, 2) that follow each other, `delta` poses apart."""
    starts = np.arange(0, count, delta, dtype=np.int64)
    return np.column_stack([starts[:-1], starts[1:]])


def pairs_by_distance(truth: Trajectory, delta: float) -> NDArray[np.int64]:
    """Pairs (M, 2) that follow each other, each the first to lie at least `delta` [m] of the true path behind the one before."""
    steps = np.diff(truth.poses[:, :2], axis=0)
    marks, path = [0], 0.0
    for index, step in enumerate(np.linalg.norm(steps, axis=1).tolist(), 1):
        path += step
        if path >= delta:
            marks.append(index)
            path = 0.0
    return np.column_stack([marks[:-1], marks[1:]]).astype(np.int64)


def _errors(poses: FloatArray, true_poses: FloatArray) -> PoseErrors:
    difference = poses - true_poses
    return PoseErrors(np.hypot(difference[:, 0], difference[:, 1]), np.abs(wrap_angles(difference[:, 2])))


def _spread(points: FloatArray) -> float:
    return float(np.linalg.norm(points.std(axis=0)))


def _require(near: NDArray[np.bool_], truth: Trajectory, estimate: Trajectory, max_difference: float) -> None:
    if not np.any(near):
        spans = [f"{t.stamps[0]:.3f}..{t.stamps[-1]:.3f} s" if len(t) else "nothing" for t in (truth, estimate)]
        raise TrajectoryError(f"no stamps within {max_difference} s of each other: truth covers {spans[0]}, estimate {spans[1]}")
