"""From a scan to points: the only conversion on the way to the map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slam.kernels import deskew as kernels
from slam.messages import LaserScan, Trajectory
from slam.se2 import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class PointScan:
    """A scan as points in `base` at the time of its first beam."""

    stamp: float
    points: FloatArray
    """(M, 2) hits [m]."""
    origins: FloatArray
    """(M, 2) where the laser was at each beam's time [m]."""


def deskew(scan: LaserScan, odometry: Trajectory) -> PointScan:
    """Undo the robot's motion during the sweep; invalid and out-of-range beams are left out.

    Args:
        scan: as measured.
        odometry: T_odom_base around the sweep; held beyond its ends, no motion when empty.
    """
    R = scan.T_base_laser.R
    directions = np.outer(np.cos(scan.angles), R[:, 0]) + np.outer(np.sin(scan.angles), R[:, 1])
    poses = odometry.poses.copy()
    poses[:, 2] = np.unwrap(poses[:, 2])
    limits, times = (scan.range_min, scan.range_max), (scan.stamp, scan.time_increment)
    points, origins = kernels.deskew(scan.ranges, directions, limits, times, (odometry.stamps, poses), scan.T_base_laser.t)
    return PointScan(scan.stamp, points, origins)
