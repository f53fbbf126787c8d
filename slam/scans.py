"""From a scan to points: the only conversion on the way to the map."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from slam.errors import require_not_negative, require_positive
from slam.kernels import deskew as kernels
from slam.kernels import veils
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


@dataclass(frozen=True, slots=True)
class Unveil:
    """Takes out the points that hang between two surfaces, because the spot of one beam lay on both.

    As the scan shadows filter of ROS's laser_filters does, by the angle between the beam and the line to the next point; a point
    goes only if it is behind a surface and nothing else is at its depth: walls met at a flat angle and thin posts stay.
    """

    noise: float = 0.01
    """Standard deviation of near ranges [m]."""
    noise_share: float = 0.01
    """Standard deviation of far ranges, as a share of the range."""
    sigmas: float = 2.0
    """By so many standard deviations may two ranges on one surface differ, more than by its slant; 0 keeps all points."""
    flattest: float = 0.3
    """Smallest angle between a beam and a surface whose points are told from hanging ones [rad]."""
    window: int = 2
    """Beams to each side among which the nearest valid one is the neighbour."""

    def __post_init__(self) -> None:
        require_not_negative(self, "noise", "noise_share", "sigmas")
        require_positive(self, "flattest", "window")

    def clean(self, scan: LaserScan) -> LaserScan:
        """The scan with nan in place of the ranges between surfaces."""
        if self.sigmas == 0.0:
            return scan
        difference = math.sqrt(2.0) * self.sigmas
        model = (difference * self.noise, difference * self.noise_share, 1.0 / math.tan(self.flattest))
        return replace(scan, ranges=veils.unveil(scan.ranges, scan.angles, (scan.range_min, scan.range_max), model, self.window))


def deskew(scan: LaserScan, odometry: Trajectory) -> PointScan:
    """Undo the robot's motion during the sweep; invalid and out-of-range beams are left out.

    Args:
        scan: as measured.
        odometry: T_odom_base around the sweep; held beyond its ends, no motion when empty.
    """
    limits, times, mount = (scan.range_min, scan.range_max), (scan.stamp, scan.time_increment), scan.T_base_laser
    points, origins = kernels.deskew(scan.ranges, scan.angles, limits, times, (odometry.stamps, odometry.poses), (mount.R, mount.t))
    return PointScan(scan.stamp, points, origins)
