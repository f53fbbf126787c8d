"""A lidar that is not mounted as it is said to be."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from slam.mapping.agreement import DISAGREE, MotionAgreement
from slam.mapping.lidar import Lidar
from slam.mapping.lidar_slam import LidarSlam
from slam.messages import LaserScan, SensorFrame, Status
from slam.se2 import SE2

STEPS = [SE2(0.1), SE2(0.08, 0.0, 0.1), SE2(0.0, 0.0, -0.2)]


def after(rounds: int, by_scans: Callable[[SE2], SE2]) -> bool:
    agreement = MotionAgreement()
    for step in STEPS * rounds:
        agreement.add(by_scans(step), step, True)
    return agreement.broken


def test_wheels_that_slip_a_little_agree() -> None:
    assert not after(50, lambda step: SE2(0.8 * step.x, 0.01, 0.9 * step.yaw))


@pytest.mark.parametrize("by_scans", [lambda step: SE2(step.x, step.y, -step.yaw), lambda step: SE2(step.y, step.x, step.yaw)])
def test_another_turn_or_another_way_is_a_disagreement(by_scans: Callable[[SE2], SE2]) -> None:
    assert after(50, by_scans)
    assert not after(1, by_scans)


def test_odometry_that_stands_still_is_not_judged() -> None:
    agreement = MotionAgreement()
    for step in STEPS * 50:
        agreement.add(step, SE2(), True)
    assert not agreement.broken


def upside_down(scan: LaserScan) -> LaserScan:
    return replace(scan, angles=-scan.angles)


def looking_left(scan: LaserScan) -> LaserScan:
    return replace(scan, angles=scan.angles + 0.5 * np.pi)


@pytest.mark.parametrize("settings", [Lidar(), LidarSlam()], ids=["lidar", "lidar_slam"])
@pytest.mark.parametrize(("wrong", "said"), [(None, False), (upside_down, True), (looking_left, True)])
def test_a_lidar_mounted_otherwise_than_said_is_named(
    settings: Lidar | LidarSlam, wrong: Callable[[LaserScan], LaserScan] | None, said: bool, two_rounds: list[SensorFrame]
) -> None:
    pipeline = settings.build()
    frames = two_rounds[:110] if wrong is None else [replace(f, scans=tuple(map(wrong, f.scans))) for f in two_rounds[:110]]
    estimates = [pipeline.update(frame) for frame in frames]
    assert (DISAGREE in {estimate.reason for estimate in estimates}) == said
    assert (estimates[-1].status == Status.TRACKING) != said
    assert all(math.isfinite(estimate.T_map_base.x) for estimate in estimates)
