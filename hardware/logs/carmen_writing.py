"""A recording as a CARMEN log: `ODOM` and `ROBOTLASER1`, which tells its own fan of beams."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hardware.errors import SpecError
from hardware.logs.log import Log
from slam.messages import LaserScan, WheelOdometry
from slam.se2 import SE2

NOTHING = 1.001
"""What a beam without an echo reports, of the largest range."""


def carmen_lines(log: Log) -> Iterator[str]:
    """The log's odometry and scans, one line each; every scan with the pose that was known then.

    Raises:
        SpecError: the recording has no lidar, or one that is not level: CARMEN has no place for its mount.
    """
    lidar = log.spec.lidar
    if lidar is None or abs(lidar.T_base_laser.R[2, 2] - 1.0) > 1e-6:
        raise SpecError("a CARMEN log holds the scans of one level, upright lidar; convert to a rosbag instead")
    mount = lidar.T_base_laser.to_se2()
    if abs(mount.y) > 1e-9 or abs(mount.yaw) > 1e-9:
        raise SpecError("a CARMEN log holds a lidar on the robot's long axis, looking forward; convert to a rosbag instead")
    yield f"PARAM robot_frontlaser_offset {mount.x:.9g} nohost 0"
    pose, speed = SE2(), (0.0, 0.0)
    for event in log.events():
        match event.message:
            case WheelOdometry() as reading:
                pose, speed = reading.T_odom_base, (reading.twist.v, reading.twist.omega)
                yield f"ODOM {_pose(pose)} {speed[0]:.9g} {speed[1]:.9g} 0 {reading.stamp:.9f} bricktwin {event.arrival:.9f}"
            case LaserScan() as scan:
                yield _robotlaser(scan, mount, pose, speed, event.arrival)
            case _:
                pass


def _robotlaser(scan: LaserScan, mount: SE2, pose: SE2, speed: tuple[float, float], arrival: float) -> str:
    step = float(scan.angles[1] - scan.angles[0]) if len(scan.angles) > 1 else 0.0
    ranges = np.where(np.isposinf(scan.ranges), NOTHING * scan.range_max, np.where(np.isfinite(scan.ranges), scan.ranges, 0.0))
    echoes = " ".join(f"{value:.6g}" for value in ranges.tolist())
    fan = f"0 {scan.angles[0]:.9g} {step * (len(ranges) - 1):.9g} {step:.9g} {scan.range_max:.9g} 0.01 0"
    tail = f"{speed[0]:.9g} {speed[1]:.9g} 0 0 0 {scan.stamp:.9f} bricktwin {arrival:.9f}"
    return f"ROBOTLASER1 {fan} {len(ranges)} {echoes} 0 {_pose(pose @ mount)} {_pose(pose)} {tail}"


def _pose(T: SE2) -> str:
    return f"{T.x:.9g} {T.y:.9g} {T.yaw:.9g}"
