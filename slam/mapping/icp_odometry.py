"""The `icp_odometry` pipeline: the source report's chain as it stands. The named baseline of all lidar pipelines.

Scan n is laid over scan n - 1 by point-to-point ICP, the motions are composed, and every scan is drawn by Bresenham
rays into a fixed grid. No deskew, no keyframes, no map to match against: errors add up from scan to scan.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from slam.errors import require_positive
from slam.grid import LOG_ODDS_LIMIT, GridGeometry, OccupancyGrid
from slam.kernels import bresenham
from slam.mapping.agreement import DISAGREE, MotionAgreement
from slam.matching.icp import Icp
from slam.matching.match import Match
from slam.messages import Estimate, LaserScan, SensorFrame, Status, Trajectory
from slam.motion.dead_reckoning import DeadReckoning
from slam.motion.scan_trajectory import ScanTrajectory
from slam.motion.sensor_watch import SensorWatch
from slam.scans import deskew
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot

UNMATCHED = np.diag([0.1**2, 0.1**2, 0.1**2])
"""Covariance of a step that ICP could not find [m, rad]."""
NO_MOTION = Trajectory(np.empty(0), np.empty((0, 3)))


@dataclass(frozen=True, slots=True)
class IcpOdometry:
    """Scan-to-scan ICP and an accumulating grid."""

    icp: Icp = field(default_factory=Icp)
    guess: Literal["odometry", "none"] = "odometry"
    """Where ICP starts: from what wheels and gyro say, so that it corrects odometry, or from no motion."""
    size: float = 20.0
    """Side of the square map about the start [m]."""
    resolution: float = 0.05
    """Cell size [m]."""
    hit: float = 0.85
    """Log-odds of a hit (p = 0.7)."""
    miss: float = -0.4
    """Log-odds of a cell that a ray crosses (p = 0.4)."""

    def __post_init__(self) -> None:
        require_positive(self, "size", "resolution", "hit")

    def build(self, T_map_base: SE2 | None = None) -> IcpOdometryPipeline:
        """Make the pipeline; the robot starts at `T_map_base`, the origin by default."""
        return IcpOdometryPipeline(self, T_map_base or SE2())


class IcpOdometryPipeline:
    """`T_map_base` at a scan is the product of all steps before it; between scans odometry carries it."""

    def __init__(self, settings: IcpOdometry, T_map_base: SE2) -> None:
        self._settings = settings
        self._motion = DeadReckoning()
        self._watch = SensorWatch()
        self._path = ScanTrajectory()
        cells = math.ceil(settings.size / settings.resolution)
        corner = SE2(T_map_base.x - 0.5 * settings.size, T_map_base.y - 0.5 * settings.size)
        self._grid = OccupancyGrid.empty(GridGeometry(settings.resolution, cells, cells, corner))
        self._T_map_base = T_map_base
        self._T_odom_base = SE2()  # at the last scan
        self._points: FloatArray | None = None  # of the last scan, in its base
        self._covariance = np.zeros((3, 3))
        self._match: Match | None = None
        self._agreement = MotionAgreement()

    def update(self, frame: SensorFrame) -> Estimate:
        """Register the frame's scans, each on its predecessor, and answer with the pose at the frame's time."""
        first = self._motion.empty
        self._motion.add(frame.odometry, frame.imu)
        if first and not self._motion.empty:
            self._T_odom_base = self._motion.pose_at(-np.inf)
        for scan in frame.scans:
            self._register(scan)
        pose = self._T_map_base @ self._T_odom_base.inverse() @ self._motion.pose_at(frame.stamp)
        reason = self._watch.silent(frame) or (DISAGREE if self._agreement.broken else "")
        if self._match is not None and not self._match.converged:
            reason = "the scan does not match its predecessor"
        status = Status.DEGRADED if reason else Status.TRACKING
        health = self._match.inliers if self._match else 1.0
        return Estimate(frame.stamp, pose, pose @ self._motion.wheels.inverse(), self._covariance, status, health, reason)

    def snapshot(self) -> Snapshot:
        """The map and the poses at scans so far."""
        return Snapshot(self._grid.frozen_copy(), self._path.trajectory())

    def _register(self, scan: LaserScan) -> None:
        points = deskew(scan, NO_MOTION).points
        T_odom_base = self._motion.pose_at(scan.stamp)
        self._step(points, self._T_odom_base.inverse() @ T_odom_base, self._motion.newest >= scan.stamp)
        self._T_odom_base, self._points = T_odom_base, points
        self._path.append(scan.stamp, self._T_map_base)
        self._draw(points, scan.T_base_laser.to_se2())

    def _step(self, points: FloatArray, by_odometry: SE2, covered: bool) -> None:
        """Compose the motion since the last scan: ICP's, or the guess where ICP finds none."""
        if self._points is None:
            return
        guess = by_odometry if self._settings.guess == "odometry" else SE2()
        self._match = self._settings.icp.match(points, self._points, guess)
        found = self._match.converged
        step = self._match.T_target_source if found else guess
        if found:
            self._agreement.add(step, by_odometry, covered)
        R = self._T_map_base.rotation()
        F, noise = np.eye(3), np.array(self._match.covariance if found else UNMATCHED)
        F[:2, 2] = R @ np.array([-step.y, step.x])
        noise[:2] = R @ noise[:2]
        noise[:, :2] = noise[:, :2] @ R.T
        self._covariance = F @ self._covariance @ F.T + noise
        self._T_map_base = self._T_map_base @ step

    def _draw(self, points: FloatArray, T_base_laser: SE2) -> None:
        """Bresenham rays from the laser to every hit, accumulating; what lies beyond the fixed grid is not drawn."""
        geometry, s = self._grid.geometry, self._settings
        laser = self._T_map_base @ T_base_laser
        origin = geometry.to_cells(np.array([[laser.x, laser.y]]))[0]
        hits = self._T_map_base.transform(points)
        ends = geometry.to_cells(hits)
        offsets = hits - geometry.to_points(ends)
        cells = (self._grid.log_odds, self._grid.hit_count, self._grid.hit_offset)
        bresenham.insert((int(origin[0]), int(origin[1])), ends, offsets, cells, (s.hit, s.miss, LOG_ODDS_LIMIT))
