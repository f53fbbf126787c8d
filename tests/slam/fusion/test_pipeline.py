"""The `fusion` pipeline on a short drive of the twin, sensor after sensor taken away."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from scripts.experiments.drive import Course, Drive
from slam.fusion.pipeline import Fusion, FusionPipeline
from slam.messages import Estimate, SensorFrame, Status


@pytest.fixture(scope="module")
def drive() -> Drive:
    return Course("aruco_room", 4.0, 1, camera="raster").drive()


def follow(drive: Drive, frames: tuple[SensorFrame, ...]) -> tuple[list[Estimate], FusionPipeline]:
    pipeline = Fusion().build(drive.start)
    return [pipeline.update(frame) for frame in frames], pipeline


def off(estimate: Estimate, drive: Drive) -> float:
    error = drive.pose(estimate.stamp).inverse() @ estimate.T_map_base
    return math.hypot(error.x, error.y)


def test_all_sensors_together_know_the_pose_to_millimetres(drive: Drive) -> None:
    estimates, pipeline = follow(drive, drive.frames)
    assert max(off(estimate, drive) for estimate in estimates) < 0.01
    assert estimates[-1].sources == ("lidar", "markers", "wheels", "gyro")
    assert {estimate.status for estimate in estimates} == {Status.TRACKING}
    pipeline.finish()
    assert len(pipeline.snapshot().trajectory) == len(drive.scans)


@pytest.mark.parametrize(("sensor", "named"), [("odometry", "wheel odometry"), ("imu", "gyro"), ("scans", "lidar"), ("images", "camera")])
def test_a_sensor_that_falls_silent_is_named_and_the_others_carry_on(sensor: str, named: str, drive: Drive) -> None:
    frames = tuple(frame if frame.stamp < 2.0 else dataclasses.replace(frame, **{sensor: ()}) for frame in drive.frames)
    last = follow(drive, frames)[0][-1]
    assert last.status == Status.DEGRADED
    assert named in last.reason
    assert off(last, drive) < 0.03
    assert np.linalg.eigvalsh(last.covariance).min() > 0.0


def test_the_camera_alone_is_enough(drive: Drive) -> None:
    frames = tuple(SensorFrame(frame.stamp, images=frame.images, available=frozenset({"images"})) for frame in drive.frames)
    estimates, pipeline = follow(drive, frames)
    assert off(estimates[-1], drive) < 0.03
    assert len(pipeline.snapshot().trajectory) > 0


def test_the_same_frames_give_the_same_bits(drive: Drive) -> None:
    a, b = follow(drive, drive.frames[:40])[0], follow(drive, drive.frames[:40])[0]
    assert [x.T_map_base for x in a] == [x.T_map_base for x in b]
