"""Kidnapped robots: drives that go on somewhere else, of which the robot's own sensors say nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scripts.experiments.drive import Drive
from slam.messages import Imu, LaserScan, SensorFrame, Trajectory, WheelOdometry
from slam.se2 import SE2

PERIOD = 0.1
"""From one frame to the next across the jump [s]."""


def kidnapped(drive: Drive, until: float, since: float, duration: float, begin: float = 0.0) -> Drive:
    """The drive from `begin` until a time [s], then what it was from `since` on, for a duration [s]: stamps and odometry go on smoothly.

    It is as if the robot were lifted for a moment with its wheels still: no sensor but the lidar notices.
    """
    before = [frame for frame in drive.frames if begin <= frame.stamp <= until]
    after = [frame for frame in drive.frames if since < frame.stamp <= since + duration]
    later = before[-1].stamp + PERIOD - after[0].stamp
    last = [reading for frame in before for reading in frame.odometry][-1].T_odom_base
    first = [reading for frame in drive.frames if frame.stamp <= since for reading in frame.odometry][-1].T_odom_base
    frames = (*before, *(_moved(frame, later, last @ first.inverse()) for frame in after))
    rows = [drive.pose(frame.stamp).as_array() for frame in (*before, *after)]
    return Drive(drive.world, frames, Trajectory(np.array([frame.stamp for frame in frames]), np.array(rows)), drive.walls)


def _moved(frame: SensorFrame, later: float, T_odom: SE2) -> SensorFrame:
    """A frame some time later [s], its odometry in another frame."""
    odometry: tuple[WheelOdometry, ...] = tuple(
        replace(one, stamp=one.stamp + later, T_odom_base=T_odom @ one.T_odom_base) for one in frame.odometry
    )
    imu: tuple[Imu, ...] = tuple(replace(one, stamp=one.stamp + later) for one in frame.imu)
    scans: tuple[LaserScan, ...] = tuple(replace(one, stamp=one.stamp + later) for one in frame.scans)
    return replace(frame, stamp=frame.stamp + later, odometry=odometry, imu=imu, scans=scans)
