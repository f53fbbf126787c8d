"""Readings to ROS 2 messages and back, with the same bits.

A ROS time counts whole nanoseconds and a LaserScan carries float32: stamps that are whole nanoseconds and ranges that are whole
millimetres (or float32 already) come back as they were. All other numbers are float64 on the wire too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import singledispatch
from itertools import product

import numpy as np

from hardware.hal import Command
from hardware.logs.cdr import decode, encode
from hardware.logs.log import Reading
from hardware.logs.ros_types import TOPICS, TRANSFORM
from hardware.spec import RobotSpec
from hardware.urdf import WHEELS
from slam.messages import Imu, LaserScan, Twist, WheelOdometry
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3

NANOSECONDS = 1_000_000_000
JOINTS = tuple(f"{wheel}_joint" for wheel in WHEELS)
_NO_ESTIMATE = (-1.0, *(0.0,) * 8)
"""A covariance that says that the quantity is not measured (sensor_msgs/Imu)."""

Written = Iterator[tuple[str, bytes]]


def nanoseconds(stamp: float) -> int:
    """A stamp [s] in whole nanoseconds."""
    return round(stamp * NANOSECONDS)


def _time(stamp: float) -> tuple[int, int]:
    return divmod(nanoseconds(stamp), NANOSECONDS)


def _stamp(seconds: int, nanosecond: int) -> float:
    return (seconds * NANOSECONDS + nanosecond) / NANOSECONDS


def _message(topic: str, *values: object) -> tuple[str, bytes]:
    return topic, encode(TOPICS[topic].layout, *values)


def text(topic: str, content: str) -> tuple[str, bytes]:
    """A std_msgs/String."""
    return _message(topic, content)


def mounts(spec: RobotSpec, stamp: float) -> tuple[str, bytes]:
    """The sensors' places on `base`, for /tf_static."""
    placed = {"camera": spec.T_base_camera}
    if spec.lidar is not None:
        placed["laser"] = spec.lidar.T_base_laser
    if spec.imu is not None:
        placed["imu"] = spec.imu.T_base_imu
    values: list[object] = [len(placed)]
    for name, T_base_sensor in placed.items():
        values += [*_time(stamp), "base", name, _pose3(T_base_sensor)]
    return "/tf_static", encode(" ".join(["I", *[TRANSFORM] * len(placed)]), *values)


def ground_truth(stamp: float, T_world_base: SE2) -> tuple[str, bytes]:
    """The true pose in frame `world`."""
    return _message("/ground_truth", *_time(stamp), "world", _pose(T_world_base))


@singledispatch
def written(reading: object) -> Written:
    """The (topic, message) pairs that carry one reading."""
    raise TypeError(f"no ROS message carries a {type(reading).__name__}")


@written.register
def _(reading: WheelOdometry) -> Written:
    time = _time(reading.stamp)
    if reading.wheel_angles is not None:
        yield _message("/joint_states", *time, "", JOINTS, reading.wheel_angles, (), ())
    pose, unknown = _pose(reading.T_odom_base), np.zeros(36)
    twist = (reading.twist.v, 0.0, 0.0, 0.0, 0.0, reading.twist.omega)
    yield _message("/odom", *time, "odom", "base", np.concatenate([pose, unknown, twist, unknown]))
    yield _message("/tf", 1, *time, "odom", "base", pose)


@written.register
def _(reading: Imu) -> Written:
    # In `base`: the rate is about its z axis, wherever the gyro sits.
    rate = (0.0, 0.0, reading.yaw_rate)
    values = np.concatenate([(0.0, 0.0, 0.0, 1.0), _NO_ESTIMATE, rate, np.zeros(9), np.zeros(3), _NO_ESTIMATE])
    yield _message("/imu", *_time(reading.stamp), "base", values)


@written.register
def _(reading: LaserScan) -> Written:
    angles, step = reading.angles, float(reading.angles[1] - reading.angles[0]) if len(reading.angles) > 1 else 0.0
    span = reading.time_increment * len(reading.ranges)
    limits = (angles[0], angles[-1], step, reading.time_increment, span, reading.range_min, reading.range_max)
    yield _message("/scan", *_time(reading.stamp), "laser", limits, reading.ranges, ())


@written.register
def _(reading: Command) -> Written:
    yield _message("/cmd_vel", *_time(reading.stamp), "base", (reading.twist.v, 0.0, 0.0, 0.0, 0.0, reading.twist.omega))


def _pose(T: SE2) -> FloatArray:
    z, w = _half_turn(T.yaw)
    return np.array([T.x, T.y, 0.0, 0.0, 0.0, z, w])


def _pose3(T: SE3) -> FloatArray:
    return np.concatenate([T.t, T.quaternion()])


def _half_turn(yaw: float) -> tuple[float, float]:
    """(z, w) of the quaternion of a heading from which `_yaw` gives the very same heading: a few units in the last place are tried."""
    z, w = math.sin(yaw / 2), math.cos(yaw / 2)
    step_z, step_w = math.ulp(z), max(math.ulp(w), math.ulp(yaw) / 2)
    for i, j in _NUDGES:
        if _yaw(z + i * step_z, w + j * step_w) == yaw:
            return z + i * step_z, w + j * step_w
    return z, w


_NUDGES = sorted(product(range(-3, 4), repeat=2), key=lambda nudge: abs(nudge[0]) + abs(nudge[1]))


def _yaw(z: float, w: float) -> float:
    return 2.0 * math.atan2(z, w)


def read_text(message: bytes) -> str:
    """The content of a std_msgs/String."""
    return decode("s", message)[0]


def read_truth(message: bytes) -> tuple[float, SE2]:
    """Stamp [s] and true pose `T_world_base`."""
    seconds, nanosecond, _, pose = decode(TOPICS["/ground_truth"].layout, message)
    return _stamp(seconds, nanosecond), _se2(pose)


class ReadingDecoder:
    """Readings of one robot from its messages; wheel angles and pose of one stamp are two messages and one reading."""

    def __init__(self, spec: RobotSpec) -> None:
        self._spec = spec
        self._wheels: tuple[float, tuple[float, float]] | None = None

    def read(self, topic: str, message: bytes) -> tuple[str, Reading] | None:
        """Channel and reading; None for a message that is none, or not yet.

        Raises:
            ValueError: a message that cannot be used.
        """
        match topic:
            case "/scan":
                return "scans", self._scan(message)
            case "/odom":
                return "odometry", self._odometry(message)
            case "/imu":
                seconds, nanosecond, _, values = decode(TOPICS[topic].layout, message)
                return "imu", Imu(_stamp(seconds, nanosecond), _finite("yaw rate", values[15:16])[0])
            case "/cmd_vel":
                seconds, nanosecond, _, values = decode(TOPICS[topic].layout, message)
                return "commands", Command(_stamp(seconds, nanosecond), _twist(values))
            case "/joint_states":
                self._joints(message)
                return None
            case _:
                return None

    def _scan(self, message: bytes) -> LaserScan:
        seconds, nanosecond, _, _, ranges, _ = decode(TOPICS["/scan"].layout, message)
        lidar = self._spec.lidar
        if lidar is None or len(ranges) != lidar.beams:
            raise ValueError(f"a scan of {len(ranges)} beams from a robot whose specification says {lidar and lidar.beams}")
        stamp = _stamp(seconds, nanosecond)
        return LaserScan(stamp, _exact(ranges), lidar.angles, lidar.time_increment, lidar.range_min, lidar.range_max, lidar.T_base_laser)

    def _odometry(self, message: bytes) -> WheelOdometry:
        seconds, nanosecond, _, _, values = decode(TOPICS["/odom"].layout, message)
        stamp = _stamp(seconds, nanosecond)
        wheels = self._wheels[1] if self._wheels is not None and self._wheels[0] == stamp else None
        return WheelOdometry(stamp, _se2(values), _twist(values[43:49]), wheels)

    def _joints(self, message: bytes) -> None:
        seconds, nanosecond, _, names, positions, _, _ = decode(TOPICS["/joint_states"].layout, message)
        angles = dict(zip(names, positions.tolist(), strict=False))
        if all(joint in angles for joint in JOINTS):
            self._wheels = _stamp(seconds, nanosecond), (angles[JOINTS[0]], angles[JOINTS[1]])


def _se2(values: FloatArray) -> SE2:
    x, y, _, _, _, z, w = _finite("pose", values[:7])
    return SE2(x, y, _yaw(z, w))


def _twist(values: FloatArray) -> Twist:
    v, _, _, _, _, omega = _finite("twist", values[:6])
    return Twist(v, omega)


def _finite(what: str, values: FloatArray) -> list[float]:
    if not np.isfinite(values).all():
        raise ValueError(f"the {what} {values.tolist()} is not finite")
    return values.tolist()


def _exact(ranges: np.ndarray[tuple[int], np.dtype[np.float32]]) -> FloatArray:
    """Ranges [m] as they were before float32: the whole millimetres that a beam is nearest to, where it is as near as can be."""
    millimetres = np.rint(ranges.astype(np.float64) * 1000.0) / 1000.0
    return np.where(millimetres.astype(np.float32) == ranges, millimetres, ranges.astype(np.float64))
