"""Where an environment's robot thinks it is: the truth, its odometry, or SLAM."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Protocol

from sim import rolling_kernel
from sim.rolling_kernel import Pose
from slam.mapping.lidar_slam import LidarSlam
from slam.messages import SensorFrame, WheelOdometry
from slam.pipelines import Pipeline
from slam.se2 import SE2, interpolate

KEPT = 100
"""Odometry readings, 2 s."""


class Locating(Protocol):
    """A source of poses in the map."""

    def update(self, frame: SensorFrame) -> None:
        """Take in what the robot has read."""
        ...

    def at(self, t: float) -> Pose:
        """T_map_base at a time of the last second [s]."""
        ...


class ByTruth:
    """The true pose, of a twin."""

    def __init__(self, true_pose: Callable[[float], SE2], T_world_map: SE2) -> None:
        self._true_pose = true_pose
        self._T_map_world = rolling_kernel.inverse(_numbers(T_world_map))

    def update(self, frame: SensorFrame) -> None:
        """See `Locating`; the truth learns nothing."""

    def at(self, t: float) -> Pose:
        """See `Locating`."""
        return rolling_kernel.compose(self._T_map_world, _numbers(self._true_pose(t)))


class ByOdometry:
    """The wheels alone."""

    def __init__(self) -> None:
        self._readings: deque[WheelOdometry] = deque(maxlen=KEPT)
        self._home: SE2 | None = None

    def update(self, frame: SensorFrame) -> None:
        """See `Locating`."""
        self._readings.extend(frame.odometry)
        if self._home is None and self._readings:
            self._home = self._readings[0].T_odom_base.inverse()

    def at(self, t: float) -> Pose:
        """See `Locating`; the newest reading holds on."""
        before = after = None
        for reading in self._readings:
            before, after = after, reading
            if reading.stamp >= t:
                break
        if after is None or self._home is None:
            return 0.0, 0.0, 0.0
        if before is None or after.stamp <= t:
            return _numbers(self._home @ after.T_odom_base)
        share = (t - before.stamp) / (after.stamp - before.stamp)
        return _numbers(self._home @ interpolate(before.T_odom_base, after.T_odom_base, share))


class BySlam:
    """The pipeline `lidar_slam`; the map is its own."""

    def __init__(self) -> None:
        self.pipeline: Pipeline = LidarSlam().build()
        self._pose = SE2()

    def update(self, frame: SensorFrame) -> None:
        """See `Locating`."""
        self._pose = self.pipeline.update(frame).T_map_base

    def at(self, t: float) -> Pose:
        """See `Locating`; the newest, whatever the time."""
        return _numbers(self._pose)


def _numbers(pose: SE2) -> Pose:
    return pose.x, pose.y, pose.yaw
