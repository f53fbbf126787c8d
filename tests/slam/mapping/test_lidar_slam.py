"""The pipeline that closes loops."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from slam.mapping.lidar_slam import LidarSlam, LidarSlamPipeline
from slam.mapping.polish import Polish
from slam.messages import Estimate, SensorFrame, Status
from slam.se2 import SE2


@pytest.fixture(scope="module")
def driven(two_rounds: list[SensorFrame]) -> tuple[LidarSlamPipeline, list[Estimate]]:
    pipeline = LidarSlam().build()
    return pipeline, [pipeline.update(frame) for frame in two_rounds]


def distances(pipeline: LidarSlamPipeline, true_pose: Callable[[float], SE2]) -> Any:
    trajectory = pipeline.snapshot().trajectory
    truth = [true_pose(stamp) for stamp in trajectory.stamps]
    return np.array([math.hypot(row[0] - pose.x, row[1] - pose.y) for row, pose in zip(trajectory.poses, truth, strict=True)])


def test_a_loop_is_closed_and_the_past_is_corrected(driven: Any, true_pose: Callable[[float], SE2]) -> None:
    pipeline, _ = driven
    assert any(link.closure for link in pipeline.submaps.believed())
    assert distances(pipeline, true_pose).max() < 0.08


def test_closures_lie_where_they_truly_are(driven: Any, true_pose: Callable[[float], SE2]) -> None:
    pipeline, _ = driven
    for link in pipeline.submaps.believed():
        T_i_j = true_pose(pipeline.submaps[link.i].stamp).inverse() @ true_pose(pipeline.submaps[link.j].stamp)
        error = T_i_j.inverse() @ link.T_i_j
        assert math.hypot(error.x, error.y) < 0.10
        assert abs(error.yaw) < math.radians(2.0)


def test_the_second_round_adds_nothing(driven: Any, two_rounds: list[SensorFrame]) -> None:
    pipeline, _ = driven
    middle = two_rounds[len(two_rounds) // 2].stamp
    assert all(submap.stamp < middle + 10.0 for submap in pipeline.submaps.all)


def test_odometry_stays_continuous_when_the_map_jumps(driven: Any, two_rounds: list[SensorFrame]) -> None:
    _, estimates = driven
    for frame, estimate in zip(two_rounds, estimates, strict=True):
        T_odom_base = estimate.T_map_odom.inverse() @ estimate.T_map_base
        np.testing.assert_allclose(T_odom_base.as_array(), frame.odometry[-1].T_odom_base.as_array(), atol=1e-9)


def test_the_covariance_covers_the_error(driven: Any, true_pose: Callable[[float], SE2]) -> None:
    _, estimates = driven
    outside = 0
    for estimate in estimates[10:]:
        pose, true = estimate.T_map_base, true_pose(estimate.stamp)
        e = np.array([pose.x - true.x, pose.y - true.y, math.remainder(pose.yaw - true.yaw, math.tau)])
        outside += e @ np.linalg.solve(estimate.covariance, e) > 16.3
    assert outside < 0.05 * len(estimates)


def test_the_same_frames_give_the_same_map(two_rounds: list[SensorFrame]) -> None:
    first, again = LidarSlam().build(), LidarSlam().build()
    for frame in two_rounds[:120]:
        first.update(frame)
        again.update(frame)
    np.testing.assert_array_equal(again.snapshot().trajectory.poses, first.snapshot().trajectory.poses)
    np.testing.assert_array_equal(again.snapshot().map.log_odds, first.snapshot().map.log_odds)


def test_finishing_makes_a_map_of_thin_walls(driven: Any, block: Any) -> None:
    pipeline, _ = driven
    pipeline.finish()
    points = (SE2(-3.0, -3.0)).transform(pipeline.snapshot().map.wall_points())
    samples = block.samples()[::10]
    nearest = np.array([np.min(np.hypot(*(samples - point).T)) for point in points])
    assert np.sqrt(np.mean(nearest**2)) < 0.04


def test_polishing_keeps_the_trajectory(two_rounds: list[SensorFrame], true_pose: Callable[[float], SE2]) -> None:
    pipeline = LidarSlam(polish=Polish(rounds=2)).build()
    for frame in two_rounds[:120]:
        pipeline.update(frame)
    pipeline.finish()
    assert len(pipeline.snapshot().trajectory) == 120
    assert distances(pipeline, true_pose).max() < 0.08


def test_without_closure_it_is_odometry_by_lidar(two_rounds: list[SensorFrame], true_pose: Callable[[float], SE2]) -> None:
    pipeline = LidarSlam(close_loops=False).build()
    statuses = [pipeline.update(frame).status for frame in two_rounds[:200]]
    assert not any(link.closure for link in pipeline.submaps.links)
    assert set(statuses) == {Status.TRACKING}
    assert distances(pipeline, true_pose).max() < 0.3
