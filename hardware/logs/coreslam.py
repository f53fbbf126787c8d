"""CoreSLAM recordings (`.dat`): a Hokuyo URG-04LX and wheel ticks, one row a sweep.

The format and the robot's constants are those of Steux and El Hamzaoui, "tinySLAM: a SLAM algorithm in less than 200
lines C-language program" (2010), and of BreezySLAM's examples.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from hardware.logs.text_log import TextLog
from hardware.spec import DriveSpec, LidarSpec, RobotSpec
from slam.messages import LaserScan, Twist, WheelOdometry
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3

TIME_COLUMN, TICK_COLUMNS, FIRST_RANGE_COLUMN = 0, (2, 3), 24
LARGEST_CODE = 20
"""Readings up to this one are no distances: 0 is "nothing seen", the others are error codes (SCIP 2.0)."""
STEP_ZERO_AGE = 0.201
"""Age of step 0 of a row's sweep at the row's stamp [s]: the sweep reached the host 101 ms after its step 0, as a URG-04LX delivers it,
and its row was stamped, with the ticks of that moment, one period later. Measured on the public recording: while the robot turns,
sweeps two rows apart, laid over each other by the ticks alone, are 29 mm apart on average at 0.2 s, 39 mm at 0.1 s, 47 mm at 0 s;
the least is at 0.195 s."""
FIRST_STEP = 44

ROBOT = RobotSpec(
    name="coreslam",
    drive=DriveSpec(
        wheel_radii=(0.077, 0.077), track=0.330, counts_per_turn=2000, max_wheel_rate=26.0, max_speed=2.0, max_yaw_rate=6.0, period=0.1
    ),
    lidar=replace(LidarSpec(), model="URG-04LX", T_base_laser=SE3.from_xyz_rpy((0.145, 0.0, 0.0))),
    imu=None,
    camera=None,
    radius=0.30,
)
"""The robot of the recordings. 2000 ticks are a whole turn: where the format is said to count them over 180 deg, the two wheels' ways are
added instead of averaged. Speed limits and radius are not published; nothing is computed from them."""


class CoreSlamLog(TextLog):
    """Rows of: 0 time [us], 2 and 3 wheel ticks (left, right), from 24 on the ranges [mm] counter-clockwise."""

    def __init__(self, path: Path, spec: RobotSpec | None = None) -> None:
        self._spec = ROBOT if spec is None else spec
        self._columns = 0
        self._T_odom_base = SE2()
        self._wheels: tuple[float, float] | None = None
        super().__init__(path, spec)

    @classmethod
    def accepts(cls, path: Path, head: bytes) -> bool:
        """Whether it is called `.dat`, or starts with a row of many numbers."""
        first = head.partition(b"\n")[0].split()
        return path.suffix == ".dat" or (len(first) > FIRST_RANGE_COLUMN and all(field.isdigit() for field in first[:4]))

    @property
    def spec(self) -> RobotSpec:
        """The format's one known robot, or the given one."""
        return self._spec

    def _seen(self) -> str:
        return "no rows in it"

    def _take(self, fields: list[bytes]) -> None:
        drive, lidar = self._spec.drive, self._spec.lidar
        if drive is None or lidar is None:
            raise ValueError("the robot's specification must have a drive and a lidar")
        self._columns = self._columns or max(len(fields), FIRST_RANGE_COLUMN + lidar.beams)
        if len(fields) != self._columns:
            raise ValueError(f"{len(fields)} columns, {self._columns} expected")
        time = int(fields[TIME_COLUMN]) / 1_000_000
        left, right = (int(fields[column]) for column in TICK_COLUMNS)
        ranges = np.array([int(field) for field in fields[FIRST_RANGE_COLUMN : FIRST_RANGE_COLUMN + lidar.beams]], dtype=np.int64)
        angle_per_tick = 2.0 * np.pi / drive.counts_per_turn
        self._put_odometry(drive, time, (left * angle_per_tick, right * angle_per_tick))
        self._put_scan(lidar, time, _metres(ranges))

    def _put_odometry(self, drive: DriveSpec, time: float, wheels: tuple[float, float]) -> None:
        before = self._order.last("odometry")
        stamp, arrival = self._order.place("odometry", time, time)
        twist = Twist()
        if self._wheels is not None:
            left, right = wheels[0] - self._wheels[0], wheels[1] - self._wheels[1]
            self._T_odom_base = self._T_odom_base @ drive.increment(left, right)
            if stamp > before:
                twist = drive.twist(left / (stamp - before), right / (stamp - before))
        self._wheels = wheels
        self._put("odometry", arrival, WheelOdometry(stamp, self._T_odom_base, twist, wheels))

    def _put_scan(self, lidar: LidarSpec, time: float, ranges: FloatArray) -> None:
        first_beam = round(time - STEP_ZERO_AGE + FIRST_STEP * lidar.time_increment, 9)
        stamp, arrival = self._order.place("scans", first_beam, max(time, self._order.last("odometry")))
        scan = LaserScan(stamp, ranges, lidar.angles, lidar.time_increment, lidar.range_min, lidar.range_max, lidar.T_base_laser)
        self._put("scans", arrival, scan)


def _metres(ranges_mm: np.ndarray[tuple[int], np.dtype[np.int64]]) -> FloatArray:
    """Ranges [m] with SCIP's codes as REP 117 has them: code 0 is +inf, the others are nan."""
    ranges = ranges_mm / 1000.0
    ranges[ranges_mm <= LARGEST_CODE] = np.nan
    ranges[ranges_mm == 0] = np.inf
    return ranges
