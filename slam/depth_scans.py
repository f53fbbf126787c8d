"""A depth image as the scan of a lidar in the camera's place."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from slam.errors import ParameterError, require_positive
from slam.kernels.depth_scan import nearest
from slam.messages import LaserScan, RgbdImage, SensorFrame
from slam.se3 import SE3


@dataclass(frozen=True, slots=True)
class DepthScan:
    """Everything between two heights, seen from above: the nearest of it in each direction is the scan's range.

    Also for a camera that looks up or down: its pixels are turned into the level frame first. The floor stays out of the band, so its lower
    end must be above what the depth noise makes of the floor.
    """

    low: float = 0.06
    """Lowest obstacle [m] above the floor."""
    high: float = 0.6
    """Highest obstacle [m]."""
    range_max: float = 4.0
    """Farthest obstacle: the depth's error grows with the square of the range [m]."""
    step: float = 0.004
    """From one direction to the next [rad]."""

    def __post_init__(self) -> None:
        require_positive(self, "range_max", "step")
        if not self.low < self.high:
            raise ParameterError(self, "low", "below high")

    def scan(self, image: RgbdImage) -> LaserScan:
        """The scan, at the time of the depth image; the laser is level, in the camera's place, and looks where the camera looks."""
        info = image.depth_info
        T_base_camera = info.T_base_camera
        axis = T_base_camera.R[:, 2]
        yaw = math.atan2(axis[1], axis[0])
        T_base_laser = SE3.from_xyz_rpy((float(T_base_camera.t[0]), float(T_base_camera.t[1]), float(T_base_camera.t[2])), (0.0, 0.0, yaw))
        R = np.ascontiguousarray(T_base_laser.R.T @ T_base_camera.R)
        half = math.atan(max(info.K[0, 2], info.width - info.K[0, 2]) / float(info.K[0, 0]))
        count = 2 * math.ceil(half / self.step) + 1
        first = -0.5 * (count - 1) * self.step
        t = np.array(T_base_laser.t)
        ranges = nearest(image.depth, np.array(info.K), (R, t), (self.low, self.high, self.range_max), (first, self.step, count))
        angles = np.linspace(first, -first, count)
        return LaserScan(image.stamp, ranges, angles, 0.0, 0.05, self.range_max, T_base_laser)


Source = Literal["auto", "lidar", "depth"]


def scans_of(frame: SensorFrame, source: Source, depth: DepthScan) -> tuple[LaserScan, ...]:
    """A frame's scans: of the lidar, of its depth images, or of the lidar where the body has one."""
    if source == "lidar" or (source == "auto" and "scans" in frame.available):
        return frame.scans
    return tuple(depth.scan(image) for image in frame.images)
