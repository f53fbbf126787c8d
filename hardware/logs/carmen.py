"""CARMEN logs: `PARAM`, `ODOM`, `FLASER`. Other records of the format are passed over.

ODOM x y theta tv rv accel time host logger_time
FLASER n r_1 .. r_n laser_x laser_y laser_theta x y theta time host logger_time
"""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from hardware.logs.log import LARGEST_VALUE
from hardware.logs.text_log import TextLog
from hardware.spec import DriveSpec, LidarSpec, RobotSpec
from slam.messages import LaserScan, Twist, WheelOdometry
from slam.se2 import SE2
from slam.se3 import SE3

MAX_RANGE = 81.8
"""Readings from here on are "nothing seen" [m], unless the log's parameters name another limit: a SICK LMS reports 81.83."""
FIELD_OF_VIEW_DEG = 180.0
RECORD = re.compile(rb"[A-Z][A-Z0-9_]*$")

ROBOT = RobotSpec(
    name="carmen",
    drive=DriveSpec(
        wheel_radii=(0.0825, 0.0825), track=0.33, counts_per_turn=10000, max_wheel_rate=20.0, max_speed=1.6, max_yaw_rate=5.0, period=0.2
    ),
    lidar=None,
    imu=None,
    radius=0.30,
)
"""A CARMEN log does not describe its wheels: these are about a Pioneer 2's, and nothing is computed from them."""


class CarmenLog(TextLog):
    """Wheel odometry as poses, and the scans of a front laser."""

    def __init__(self, path: Path, spec: RobotSpec | None = None) -> None:
        self._spec = ROBOT if spec is None else spec
        self._parameters: dict[bytes, float] = {}
        self._records: Counter[str] = Counter()
        super().__init__(path, spec)

    @classmethod
    def accepts(cls, path: Path, head: bytes) -> bool:
        """Whether the first line that is no comment starts with a record's name, or the file is called `.log`, `.clf` or `.carmen`."""
        rows = (line.split() for line in head.split(b"\n"))
        first = next((row[0] for row in rows if row and not row[0].startswith(b"#")), b"")
        return first in (b"PARAM", b"ODOM", b"FLASER", b"SYNC") or path.suffix in (".log", ".clf", ".carmen")

    @property
    def spec(self) -> RobotSpec:
        """Lidar from the parameters and the scans; or the given robot."""
        return self._spec

    def _seen(self) -> str:
        counts = ", ".join(f"{count} {name}" for name, count in self._records.items())
        return f"no FLASER records; found: {counts or 'nothing'}"

    def _take(self, fields: list[bytes]) -> None:
        if not RECORD.match(fields[0]):
            raise ValueError(f"{fields[0][:20]!r} is no CARMEN record; PARAM, ODOM or FLASER expected")
        self._records[fields[0].decode()] += 1
        if fields[0] == b"ODOM":
            self._take_odometry(fields)
        elif fields[0] == b"FLASER":
            self._take_scan(fields)
        elif fields[0] == b"PARAM":
            self._take_parameter(fields)

    def _take_parameter(self, fields: list[bytes]) -> None:
        if len(fields) < 3:
            raise ValueError("PARAM needs a name and a value")
        if fields[1] in (b"robot_frontlaser_offset", b"laser_front_laser_resolution", b"robot_front_laser_max"):
            self._parameters[fields[1]] = value = float(fields[2])
            if not math.isfinite(value):
                raise ValueError(f"{fields[1].decode()} is {value}, must be finite")

    def _take_odometry(self, fields: list[bytes]) -> None:
        if len(fields) != 10:
            raise ValueError(f"ODOM has {len(fields)} fields, 10 expected")
        x, y, theta, v, omega, _, time = (float(field) for field in fields[1:8])
        self._put_odometry(time, (x, y, theta), Twist(v, omega))

    def _put_odometry(self, time: float, pose: tuple[float, float, float], twist: Twist) -> None:
        if not all(abs(value) <= LARGEST_VALUE for value in (*pose, twist.v, twist.omega)):
            raise ValueError(f"pose {pose} is not finite or beyond {LARGEST_VALUE:g}, or its speed is")
        stamp, arrival = self._order.place("odometry", time, time)
        self._put("odometry", arrival, WheelOdometry(stamp, SE2(*pose), twist))

    def _take_scan(self, fields: list[bytes]) -> None:
        beams = int(fields[1]) if len(fields) > 1 else 0
        if beams < 2 or len(fields) != beams + 11:
            raise ValueError(f"FLASER of {beams} beams has {len(fields)} fields, {beams + 11} expected")
        ranges = np.array([float(field) for field in fields[2 : beams + 2]])
        x, y, theta, time = (float(field) for field in fields[beams + 5 : beams + 9])
        lidar = self._lidar(beams)
        # A scan carries the wheels' pose of its own instant. Older than what ODOM has told, it would only turn the odometry back.
        if time > self._order.last("odometry"):
            self._put_odometry(time, (x, y, theta), Twist())
        ranges[ranges >= lidar.range_max] = np.inf
        ranges[ranges <= 0.0] = np.nan
        stamp, arrival = self._order.place("scans", time, time)
        scan = LaserScan(stamp, ranges, lidar.angles, lidar.time_increment, lidar.range_min, lidar.range_max, lidar.T_base_laser)
        self._put("scans", arrival, scan)

    def _lidar(self, beams: int) -> LidarSpec:
        """The laser, known from the first scan on."""
        if self._spec.lidar is None:
            degrees = self._parameters.get(b"laser_front_laser_resolution", FIELD_OF_VIEW_DEG / (beams - beams % 2))
            lidar = LidarSpec(
                model="SICK LMS",
                beams=beams,
                angle_min=-math.pi / 2,
                angle_increment=math.radians(degrees),
                time_increment=0.0,
                period=0.2,
                range_min=0.0,
                range_max=self._parameters.get(b"robot_front_laser_max", MAX_RANGE),
                T_base_laser=SE3.from_xyz_rpy((self._parameters.get(b"robot_frontlaser_offset", 0.0), 0.0, 0.0)),
            )
            self._spec = replace(self._spec, lidar=lidar)
            return lidar
        if self._spec.lidar.beams != beams:
            raise ValueError(f"a scan of {beams} beams among scans of {self._spec.lidar.beams}")
        return self._spec.lidar
