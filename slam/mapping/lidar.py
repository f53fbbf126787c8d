"""The `lidar` pipeline: deskew, match to the local map, insert, propagate. No loop closure."""

from __future__ import annotations

from dataclasses import dataclass, field

from slam.mapping.front_end import FrontEnd, Tracking
from slam.mapping.grid_mapper import FULL, GridMapper, MapSettings
from slam.messages import Estimate, LaserScan, SensorFrame, Status
from slam.motion.keyframes import KeyframeGate
from slam.motion.scan_trajectory import ScanTrajectory
from slam.motion.sensor_watch import SensorWatch
from slam.se2 import SE2
from slam.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class Lidar:
    """Lidar odometry against its own growing map."""

    map: MapSettings = field(default_factory=MapSettings)
    tracking: Tracking = field(default_factory=Tracking)
    keyframes: KeyframeGate = field(default_factory=KeyframeGate)

    def build(self, T_map_base: SE2 | None = None) -> LidarPipeline:
        """Make the pipeline; the robot starts at `T_map_base`, the origin by default."""
        return LidarPipeline(self, T_map_base or SE2())


class LidarPipeline:
    """Keeps `T_map_odom` right by matching every scan; between scans wheels and gyro carry the pose."""

    def __init__(self, settings: Lidar, T_map_base: SE2) -> None:
        self._keyframes = settings.keyframes
        self._front = FrontEnd(settings.tracking, T_map_base)
        self._watch = SensorWatch()
        self._mapper = GridMapper(settings.map)
        self._path = ScanTrajectory()
        self._inserted: SE2 | None = None  # T_map_base of the last scan inserted

    def update(self, frame: SensorFrame) -> Estimate:
        """Register the frame's scans and answer with the pose at the frame's time."""
        self._front.ego.hear(frame)
        for scan in frame.scans:
            self._register(scan)
        return self._estimate(frame)

    def snapshot(self) -> Snapshot:
        """The map and the poses at scans so far."""
        return Snapshot(self._mapper.snapshot(), self._path.trajectory())

    def _register(self, scan: LaserScan) -> None:
        cloud = self._front.ego.points(scan)
        first = self._inserted is None and len(cloud.points) > 0
        T_map_base = self._front.track(cloud, None if first else self._mapper.field)
        self._path.append(scan.stamp, T_map_base)
        if len(cloud.points) > 0 and self._keyframes.passes(self._inserted, T_map_base):
            self._mapper.insert(T_map_base, cloud.points, cloud.origins)
            self._inserted = self._inserted if self._mapper.full else T_map_base

    def _estimate(self, frame: SensorFrame) -> Estimate:
        pose, covariance = self._front.at(frame.stamp)
        silent = self._watch.silent(frame)  # hears every frame
        reason = (FULL if self._mapper.full else "") or self._front.trouble or silent
        status = Status.LOST if self._front.lost else Status.DEGRADED if reason else Status.TRACKING
        return Estimate(frame.stamp, pose, pose @ self._front.motion.wheels.inverse(), covariance, status, self._front.health, reason)
