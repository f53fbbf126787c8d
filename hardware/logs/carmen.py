"""CARMEN logs: `PARAM`, `ODOM`, `FLASER`, `ROBOTLASER1`. Other records of the format are passed over.

ODOM x y theta tv rv accel time host logger_time
FLASER n r_1 .. r_n laser_x laser_y laser_theta x y theta time host logger_time
ROBOTLASER1 type start_angle fov resolution max_range accuracy remission_mode n r_1 .. r_n m remission_1 .. remission_m
    laser_x laser_y laser_theta x y theta tv rv forward_safety side_safety turn_axis time host logger_time
"""

from __future__ import annotations

import logging
import math
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from hardware.logs.carmen_records import (
    SCAN_RECORDS,
    LaserRecord,
    Pose,
    centred_fan,
    field_of_view_deg,
    limited,
    odometry_record,
    repeated_limit,
)
from hardware.logs.log import LARGEST_VALUE
from hardware.logs.text_log import TextLog
from hardware.spec import DriveSpec, LidarSpec, RobotSpec
from slam.messages import LaserScan, Twist, WheelOdometry
from slam.se2 import SE2
from slam.se3 import SE3

_log = logging.getLogger(__name__)

MAX_RANGE = 81.8
"""Readings from here on are "nothing seen" [m], unless the log names another limit: a SICK LMS reports 81.83, and names 81.9 or so."""
SICK_MAX_RANGES = (MAX_RANGE, 82.0)
SHORTEST_STEP = 1e-3
"""Poses nearer in time [s] tell no speed."""
RECORD = re.compile(rb"[A-Za-z0-9_.-]+")
PARAMETERS = (b"robot_frontlaser_offset", b"laser_front_laser_resolution", b"laser_front_laser_fov", b"robot_front_laser_max")
ROBOT = RobotSpec(
    name="carmen",
    drive=DriveSpec(
        wheel_radii=(0.0825, 0.0825), track=0.33, counts_per_turn=10000, max_wheel_rate=20.0, max_speed=1.6, max_yaw_rate=5.0, period=0.2
    ),
    lidar=None,
    imu=None,
    camera=None,
    radius=0.30,
)
"""A CARMEN log does not describe its wheels: these are about a Pioneer 2's, and nothing is computed from them."""


class CarmenLog(TextLog):
    """Wheel odometry as poses, and the scans of a front laser."""

    def __init__(self, path: Path, spec: RobotSpec | None = None) -> None:
        self._spec = ROBOT if spec is None else spec
        self._parameters: dict[bytes, float] = {}
        self._records: Counter[str] = Counter()
        self._scan_record = b""
        self._newest: WheelOdometry | None = None
        super().__init__(path, spec)
        if spec is None or spec.lidar is None:
            self._find_limit()

    @classmethod
    def accepts(cls, path: Path, head: bytes) -> bool:
        """Whether the first line that is no comment starts with a record's name, or the file is called `.log`, `.clf` or `.carmen`."""
        rows = (line.split() for line in head.split(b"\n"))
        first = next((row[0] for row in rows if row and not row[0].startswith(b"#")), b"")
        return first in (b"PARAM", b"ODOM", b"SYNC", *SCAN_RECORDS) or path.suffix in (".log", ".clf", ".carmen")

    @property
    def spec(self) -> RobotSpec:
        """Lidar from the parameters and the scans; or the given robot."""
        return self._spec

    def _seen(self) -> str:
        counts = ", ".join(f"{count} {name[:20]}" for name, count in self._records.most_common(8))
        return f"no FLASER records; found: {counts or 'nothing'}"

    def _take(self, fields: list[bytes]) -> None:
        name = fields[0]
        if not RECORD.fullmatch(name):
            raise ValueError(f"{name[:20]!r} is no CARMEN record; PARAM, ODOM, FLASER or ROBOTLASER1 expected")
        self._records[name.decode()] += 1
        if name == b"ODOM":
            self._put_odometry(*odometry_record(fields))
        elif name in SCAN_RECORDS and self._scan_record in (b"", name):  # a log with both tells every scan twice
            self._put_scan(SCAN_RECORDS[name](fields))
            self._scan_record = name
        elif name == b"PARAM" and len(fields) > 1 and fields[1] in PARAMETERS:
            self._take_parameter(fields[1], b" ".join(fields[2:3]))

    def _take_parameter(self, name: bytes, text: bytes) -> None:
        try:
            value = float(text)
        except ValueError:
            _log.warning("%s: PARAM %s is %r, no number; ignored", self._path, name.decode(), text.decode(errors="replace")[:20])
            return
        if not math.isfinite(value):
            raise ValueError(f"{name.decode()} is {value}, must be finite")
        self._parameters[name] = value

    def _put_odometry(self, time: float, pose: Pose, twist: Twist | None) -> None:
        """Put a pose; without a `twist` its speed is that from the pose before."""
        speeds = (0.0, 0.0) if twist is None else (twist.v, twist.omega)
        if not all(abs(value) <= LARGEST_VALUE for value in (*pose, *speeds)):
            raise ValueError(f"pose {pose} is not finite or beyond {LARGEST_VALUE:g}, or its speed is")
        stamp, arrival = self._order.place("odometry", time, time)
        T_odom_base = SE2(*pose)
        self._newest = WheelOdometry(stamp, T_odom_base, self._differenced(stamp, T_odom_base) if twist is None else twist)
        self._put("odometry", arrival, self._newest)

    def _differenced(self, stamp: float, T_odom_base: SE2) -> Twist:
        before = self._newest
        if before is None:
            return Twist()
        if stamp - before.stamp < SHORTEST_STEP:
            return before.twist
        step = before.T_odom_base.inverse() @ T_odom_base
        return Twist(step.x / (stamp - before.stamp), step.yaw / (stamp - before.stamp))

    def _put_scan(self, record: LaserRecord) -> None:
        lidar, ranges = self._lidar(record), record.ranges
        # A scan carries the wheels' pose of its own instant. Older than what ODOM has told, it would only turn the odometry back.
        if record.time > self._order.last("odometry"):
            self._put_odometry(record.time, record.pose, record.twist if self._records["ODOM"] else None)
        ranges[ranges >= lidar.range_max] = np.inf
        ranges[ranges <= 0.0] = np.nan
        stamp, arrival = self._order.place("scans", record.time, record.time)
        scan = LaserScan(stamp, ranges, lidar.angles, lidar.time_increment, lidar.range_min, lidar.range_max, lidar.T_base_laser)
        self._put("scans", arrival, scan)

    def _lidar(self, record: LaserRecord) -> LidarSpec:
        """The laser, known from the first scan on."""
        beams = len(record.ranges)
        if self._spec.lidar is None:
            lidar = self._first_lidar(record, beams)
            self._spec = replace(self._spec, lidar=lidar)
            return lidar
        if self._spec.lidar.beams != beams:
            raise ValueError(f"a scan of {beams} beams among scans of {self._spec.lidar.beams}")
        return self._spec.lidar

    def _first_lidar(self, record: LaserRecord, beams: int) -> LidarSpec:
        fan = record.fan or centred_fan(beams, self._view_deg(beams))
        told = record.range_max or self._parameters.get(b"robot_front_laser_max", MAX_RANGE)
        sick = record.range_max is not None and SICK_MAX_RANGES[0] <= told <= SICK_MAX_RANGES[1]
        return LidarSpec(
            model="SICK LMS",
            beams=beams,
            angle_min=fan.angle_min,
            angle_increment=fan.angle_increment,
            time_increment=0.0,
            period=0.2,
            range_min=0.0,
            range_max=MAX_RANGE if sick else told,
            T_base_laser=SE3.from_xyz_rpy((self._parameters.get(b"robot_frontlaser_offset", 0.0), 0.0, 0.0)),
        )

    def _view_deg(self, beams: int) -> float:
        view, agrees = field_of_view_deg(beams, self._parameters)
        if not agrees:
            told = self._parameters[b"laser_front_laser_resolution"]
            text = "%s: %d beams at PARAM resolution %g deg contradict their field of view; %g deg assumed, give another robot by --spec"
            _log.warning(text, self._path, beams, told, view)
        return view

    def _find_limit(self) -> None:
        """Take a largest reading that repeats as "nothing seen", where nothing else says so."""
        lidar, scans = self._spec.lidar, [event.message.ranges for event in self._events if isinstance(event.message, LaserScan)]
        limit = repeated_limit(np.concatenate(scans))
        if lidar is not None and limit is not None:
            self._spec = replace(self._spec, lidar=replace(lidar, range_max=float(np.nextafter(limit, 0.0))))
            self._events = [replace(event, message=limited(event.message, limit)) for event in self._events]
