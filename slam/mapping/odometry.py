"""The `odometry` pipeline: wheels and gyro only, mapping all the same. The floor that everything is compared with."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slam.mapping.grid_mapper import FULL, GridMapper, MapSettings
from slam.messages import Estimate, SensorFrame, Status
from slam.motion.dead_reckoning import DeadReckoning
from slam.motion.keyframes import KeyframeGate
from slam.motion.motion_noise import MotionNoise
from slam.motion.scan_trajectory import ScanTrajectory
from slam.motion.sensor_watch import SensorWatch
from slam.scans import Unveil, deskew
from slam.se2 import SE2
from slam.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class Odometry:
    """Dead reckoning by wheels and gyro; scans are inserted where it says."""

    unveil: Unveil = field(default_factory=Unveil)
    map: MapSettings = field(default_factory=MapSettings)
    noise: MotionNoise = field(default_factory=MotionNoise)
    keyframes: KeyframeGate = field(default_factory=KeyframeGate)

    def build(self, T_map_base: SE2 | None = None) -> OdometryPipeline:
        """Make the pipeline; the robot starts at `T_map_base`, the origin by default."""
        return OdometryPipeline(self, T_map_base or SE2())


class OdometryPipeline:
    """`T_map_base` is the start composed with what wheels and gyro have turned."""

    def __init__(self, settings: Odometry, T_map_base: SE2) -> None:
        self._settings = settings
        self._start = T_map_base
        self._motion = DeadReckoning()
        self._watch = SensorWatch()
        self._mapper = GridMapper(settings.map)
        self._path = ScanTrajectory()
        self._last = SE2()
        self._covariance = np.zeros((3, 3))
        self._T_map_odom = T_map_base
        self._keyframe: SE2 | None = None

    def update(self, frame: SensorFrame) -> Estimate:
        """Dead reckoning up to the frame's newest odometry."""
        first = self._motion.empty
        self._motion.add(frame.odometry, frame.imu)
        if first and not self._motion.empty:
            self._last = self._motion.pose_at(-np.inf)
            self._T_map_odom = self._start @ self._last.inverse()
        for scan in frame.scans:
            cloud = deskew(self._settings.unveil.clean(scan), self._motion.window(scan.stamp))
            T_map_base = self._T_map_odom @ self._motion.pose_at(scan.stamp)
            self._path.append(scan.stamp, T_map_base)
            if len(cloud.points) > 0 and self._settings.keyframes.passes(self._keyframe, T_map_base):
                self._mapper.insert(T_map_base, cloud.points, cloud.origins)
                self._keyframe = self._keyframe if self._mapper.full else T_map_base
        return self._estimate(frame)

    def snapshot(self) -> Snapshot:
        """The map and the poses at scans so far."""
        return Snapshot(self._mapper.snapshot(), self._path.trajectory())

    def _estimate(self, frame: SensorFrame) -> Estimate:
        T_odom_base = self._motion.pose_at(frame.stamp)
        pose = self._T_map_odom @ T_odom_base
        increment = self._last.inverse() @ T_odom_base
        self._covariance = self._settings.noise.propagate(self._covariance, pose @ increment.inverse(), increment)
        self._last = T_odom_base
        reason = FULL if self._mapper.full else self._watch.silent(frame)
        status = Status.DEGRADED if reason else Status.TRACKING
        return Estimate(frame.stamp, pose, pose @ self._motion.wheels.inverse(), self._covariance, status, reason=reason)
