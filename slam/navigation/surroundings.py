"""What the lidar has seen about the robot a moment ago, behind it too: people, and what no map shows."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from slam.errors import require_positive
from slam.messages import Estimate, LaserScan, SensorFrame, Trajectory, WheelOdometry
from slam.scans import Unveil, deskew
from slam.se2 import SE2, FloatArray, interpolate

ODOMETRY_KEPT = 1.0
"""[s]"""


@dataclass(frozen=True, slots=True)
class Memory:
    """How long and how far hits are remembered."""

    span: float = 1.0
    """Age at which a hit is forgotten [s]."""
    reach: float = 3.0
    """Hits farther than this from the robot are left to the map [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "span", "reach")


class Surroundings:
    """Hits of the newest scans, each placed by the pose that was known when it came."""

    def __init__(self, settings: Memory) -> None:
        self._settings = settings
        self._odometry: deque[WheelOdometry] = deque()
        self._hits: deque[tuple[float, FloatArray]] = deque()
        self._joined: FloatArray | None = None
        self._unveil = Unveil()
        self.scanned = -np.inf
        """Stamp of the newest scan [s]."""

    def hear(self, frame: SensorFrame, estimate: Estimate) -> None:
        """Take in a frame and the pose at its time."""
        self._odometry.extend(frame.odometry)
        while self._odometry and self._odometry[0].stamp < frame.stamp - ODOMETRY_KEPT:
            self._odometry.popleft()
        for scan in frame.scans:
            self._add(scan, frame.stamp, estimate.T_map_base)
        while self._hits and self._hits[0][0] < frame.stamp - self._settings.span:
            self._hits.popleft()
            self._joined = None

    def hits(self) -> FloatArray:
        """(N, 2) in the map [m], the oldest first."""
        if self._joined is None:
            self._joined = np.concatenate([np.empty((0, 2)), *(hits for _, hits in self._hits)])
        return self._joined

    def _add(self, scan: LaserScan, stamp: float, T_map_base: SE2) -> None:
        samples = Trajectory(
            np.array([reading.stamp for reading in self._odometry]),
            np.array([reading.T_odom_base.as_array() for reading in self._odometry]).reshape(-1, 3),
        )
        points = deskew(self._unveil.clean(scan), samples).points
        points = points[np.hypot(points[:, 0], points[:, 1]) < self._settings.reach]
        T_map_scan = T_map_base @ self._at(stamp).inverse() @ self._at(scan.stamp)
        self._hits.append((scan.stamp, T_map_scan.transform(points)))
        self._joined, self.scanned = None, scan.stamp

    def _at(self, stamp: float) -> SE2:
        """`T_odom_base` at a time, held beyond the ends of what is kept."""
        before = None
        for reading in self._odometry:
            if reading.stamp > stamp:
                if before is None:
                    return reading.T_odom_base
                share = (stamp - before.stamp) / (reading.stamp - before.stamp)
                return interpolate(before.T_odom_base, reading.T_odom_base, share)
            before = reading
        return before.T_odom_base if before is not None else SE2()
