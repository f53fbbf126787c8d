"""A drive round a block of rooms, with wheels that believe they turn more than they do."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from slam.messages import LaserScan, SensorFrame, WheelOdometry
from slam.se2 import SE2

ANGLES = np.linspace(-math.pi, math.pi, 360, endpoint=False)
START = SE2(-3.0, -3.0, 0.0)
STEP = 0.1
"""From scan to scan [m]."""
PROUD = np.array([1.01, 1.0, 1.03])
"""Odometry's way and turn for a true one."""


def box(x1: float, y1: float, x2: float, y2: float) -> list[list[float]]:
    return [[x1, y1, x2, y1], [x2, y1, x2, y2], [x2, y2, x1, y2], [x1, y2, x1, y1]]


def route(length: float) -> list[SE2]:
    """Poses every step along a square of 6 m, counter-clockwise, turning on the spot in its corners."""
    poses, pose, way = [START], START, 0.0
    while way < length:
        for _ in range(round(6.0 / STEP)):
            pose = pose @ SE2(STEP)
            poses.append(pose)
        for _ in range(6):
            pose = pose @ SE2(0.0, 0.0, math.pi / 12.0)
            poses.append(pose)
        way += 6.0
    return poses


def frames_of(walls: Any, poses: list[SE2], seed: int = 1, start: float = 0.0) -> list[SensorFrame]:
    """One frame for each pose: odometry from the first pose on, and a scan."""
    rng, T_odom_base, frames = np.random.default_rng(seed), SE2(), list[SensorFrame]()
    for k, pose in enumerate(poses):
        if k:
            T_odom_base = T_odom_base @ SE2.exp((poses[k - 1].inverse() @ pose).log() * PROUD)
        stamp = start + 0.25 * k
        ranges = walls.ranges(pose, ANGLES) + rng.normal(0.0, 0.01, len(ANGLES))
        scan = LaserScan(stamp, np.where(ranges < 4.0, ranges, np.inf), ANGLES, 0.0, 0.05, 4.0)
        frames.append(SensorFrame(stamp, (WheelOdometry(stamp, T_odom_base),), (), (scan,), frozenset({"odometry", "scans"})))
    return frames


@pytest.fixture(scope="session")
def block(room: Any) -> Any:
    """A corridor round a block, 2 m wide, with a pillar or a cupboard here and there."""
    outer, inner = box(-4.03, -4.02, 4.01, 4.04), box(-2.01, -2.03, 1.98, 2.02)
    things = [*box(-1.2, -4.0, -0.6, -3.6), *box(3.5, -0.4, 4.0, 0.9), *box(1.2, 2.0, 1.5, 2.4), *box(-4.0, 1.0, -3.7, 1.3)]
    return type(room)(np.array([*outer, *inner, *things], dtype=np.float64))


@pytest.fixture(scope="session")
def two_rounds(block: Any) -> list[SensorFrame]:
    return frames_of(block, route(48.0))


@pytest.fixture(scope="session")
def true_pose() -> Callable[[float], SE2]:
    """True `T_map_base` at a frame's stamp: the map begins where the robot does."""
    poses = route(48.0)
    return lambda stamp: START.inverse() @ poses[round(stamp / 0.25)]


@pytest.fixture(scope="session")
def drive_from(block: Any) -> Callable[[list[SE2]], list[SensorFrame]]:
    return lambda poses: frames_of(block, poses, seed=2)


@pytest.fixture(scope="session")
def round_poses() -> list[SE2]:
    return route(24.0)
