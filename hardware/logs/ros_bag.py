"""Anybody's rosbag1 or rosbag2 with a LaserScan, read by `rosbags`: odometry from nav_msgs/Odometry or TF, mounts from TF."""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_typestore

from hardware.errors import RecordingError
from hardware.hal import Command
from hardware.logs.held_log import HeldLog
from hardware.logs.log import LARGEST_VALUE, Event, Reading
from hardware.logs.mcap_bag import RECORDING, UNFINISHED
from hardware.logs.mcap_file import MAGIC
from hardware.logs.ros_frames import ODOMETRY, FrameTree, name_of, pose2_of
from hardware.logs.stamps import StampOrder
from hardware.spec import DriveSpec, ImuSpec, LidarSpec, RobotSpec
from slam.messages import Imu, LaserScan, Twist, WheelOdometry
from slam.se3 import SE3

_log = logging.getLogger(__name__)

NANOSECONDS = 1e9
FIRST_SECOND = 1.0
"""Later than this [s] a stamp of zero is none."""
CHANNELS = {
    "sensor_msgs/msg/LaserScan": ("scans", "/scan"),
    "nav_msgs/msg/Odometry": ("odometry", "/odom"),
    "sensor_msgs/msg/Imu": ("imu", "/imu"),
    "geometry_msgs/msg/Twist": ("commands", "/cmd_vel"),
    "geometry_msgs/msg/TwistStamped": ("commands", "/cmd_vel"),
}
"""Type -> channel, and the topic that is preferred where several have the type."""
FRAMES = "tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"
UPSIDE_DOWN = SE3.from_xyz_rpy((0.0, 0.0, 0.0), (math.pi, 0.0, 0.0))
DRIVE = DriveSpec(wheel_radii=(0.05, 0.05), track=0.3, max_wheel_rate=100.0, max_speed=5.0, max_yaw_rate=10.0)
"""A bag does not describe its wheels; nothing is computed from these."""


@dataclass(frozen=True, slots=True)
class _Robot:
    """What the first messages say of the robot."""

    base: str
    T_base_laser: SE3
    T_base_imu: SE3
    flipped: bool
    """The scans' angles decrease: the laser is described upside down instead, which is the same plane."""
    by_frames: bool
    """Odometry comes from TF."""


class RosBag(HeldLog):
    """A rosbag1 file or a rosbag2 folder or file of any robot. Implements `hardware.logs.log.Log`."""

    def __init__(self, path: Path, spec: RobotSpec | None = None) -> None:
        super().__init__(path)
        self._topics: dict[str, str] = {}
        self._first: LaserScan | None = None
        with self._open() as reader:
            self._choose(reader)
            self._robot = self._find_robot(reader)
            self._order = StampOrder()
            self._events = list(self._decoded(reader))
        self._order.report(path)
        if self._first is None:
            raise RecordingError(path, "no scan in it can be used")
        self._spec = spec or self._described(self._first)

    @classmethod
    def accepts(cls, path: Path, head: bytes) -> bool:
        """Whether it is a rosbag1 file, or a rosbag2 that bricktwin did not write."""
        if path.is_dir():
            ours = any((path / name).is_file() for name in (RECORDING, UNFINISHED))
            return (path / "metadata.yaml").is_file() and not ours
        return head.startswith((b"#ROSBAG", b"SQLite format 3")) or (
            head.startswith(MAGIC) and len(head) > len(MAGIC) and b"bricktwin" not in head
        )

    @classmethod
    def load(cls, path: Path, spec: RobotSpec | None) -> Self:
        """Read the whole bag."""
        return cls(path, spec)

    @property
    def spec(self) -> RobotSpec:
        """The robot as the bag lets it be known."""
        return self._spec

    @contextmanager
    def _open(self) -> Generator[AnyReader]:
        try:
            with AnyReader([self._path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
                yield reader
        except (AnyReaderError, OSError, ValueError, KeyError, AssertionError) as error:
            raise RecordingError(self._path, f"is no rosbag that can be read: {error or type(error).__name__}") from error

    def _choose(self, reader: AnyReader) -> None:
        """One topic for each channel: the preferred name, else the one with most messages."""
        counts: dict[str, Counter[tuple[bool, int, str]]] = {}
        for connection in reader.connections:
            channel, preferred = CHANNELS.get(connection.msgtype, ("", ""))
            if channel:
                counts.setdefault(channel, Counter())[connection.topic == preferred, connection.msgcount, connection.topic] += 1
        self._topics = {max(found)[2]: channel for channel, found in counts.items()}
        if "scans" not in self._topics.values():
            there = ", ".join(sorted({f"{c.topic} ({c.msgtype})" for c in reader.connections})) or "nothing"
            raise RecordingError(self._path, f"no sensor_msgs/LaserScan in it; it has {there}")

    def _find_robot(self, reader: AnyReader) -> _Robot:
        """Frames and mounts, from TF and the first message of each sensor."""
        tree, seen = FrameTree(), dict[str, Any]()
        for connection, _, raw in reader.messages(connections=self._wanted(reader)):
            if connection.msgtype in FRAMES:
                tree.add(_message(reader, connection, raw).transforms)
            elif self._topics[connection.topic] not in seen:
                seen[self._topics[connection.topic]] = _message(reader, connection, raw)
        scan, odometry, imu = seen["scans"], seen.get("odometry"), seen.get("imu")
        base = tree.base(odometry.child_frame_id if odometry is not None else "")
        by_frames = odometry is None and tree.between(ODOMETRY, base) is not None
        flipped = scan.angle_increment < 0.0
        T_base_laser = self._mount(tree, base, scan.header.frame_id, "laser")
        T_base_imu = SE3() if imu is None else self._mount(tree, base, imu.header.frame_id, "imu")
        return _Robot(base, T_base_laser @ UPSIDE_DOWN if flipped else T_base_laser, T_base_imu, flipped, by_frames)

    def _mount(self, tree: FrameTree, base: str, frame: str, what: str) -> SE3:
        T = tree.between(base, name_of(frame))
        if T is None:
            _log.warning(
                "%s: no transform from %s to %s; the %s is taken to sit in %s, --spec can say where", self._path, base, frame, what, base
            )
        return T or SE3()

    def _wanted(self, reader: AnyReader) -> list[Connection]:
        return [c for c in reader.connections if c.topic in self._topics or c.msgtype in FRAMES]

    def _decoded(self, reader: AnyReader) -> Iterator[Event]:
        for number, (connection, time_ns, raw) in enumerate(reader.messages(connections=self._wanted(reader))):
            try:
                message = _message(reader, connection, raw)
                arrival = time_ns / NANOSECONDS
                for channel, reading in self._readings(connection, message, arrival):
                    stamp, placed = self._order.place(channel, reading.stamp, arrival)
                    yield Event(placed, channel, reading if stamp == reading.stamp else replace(reading, stamp=stamp))
            except (ValueError, AnyReaderError) as error:
                raise RecordingError(self._path, f"message {number}, on {connection.topic}: {error}") from error

    def _readings(self, connection: Connection, message: Any, arrival: float) -> Iterator[tuple[str, Reading]]:
        if connection.msgtype in FRAMES:
            yield from self._by_frames(message, arrival)
            return
        channel = self._topics[connection.topic]
        stamp = stamp_of(message, arrival)
        match channel:
            case "scans":
                yield channel, self._scan(message, stamp)
            case "odometry":
                twist = message.twist.twist
                pose = message.pose.pose
                yield channel, WheelOdometry(stamp, pose2_of(pose.position, pose.orientation), _twist(twist))
            case "imu":
                rate = message.angular_velocity
                about_z = float((self._robot.T_base_imu.R @ [rate.x, rate.y, rate.z])[2])
                yield channel, Imu(stamp, _believable(about_z))
            case _:
                yield channel, Command(stamp, _twist(getattr(message, "twist", message)))

    def _by_frames(self, message: Any, arrival: float) -> Iterator[tuple[str, Reading]]:
        if not self._robot.by_frames:
            return
        for stamped in message.transforms:
            if name_of(stamped.header.frame_id) == ODOMETRY:
                pose = pose2_of(stamped.transform.translation, stamped.transform.rotation)
                yield "odometry", WheelOdometry(stamp_of(stamped, arrival), pose)

    def _scan(self, message: Any, stamp: float) -> LaserScan:
        ranges = np.array(message.ranges, np.float64)
        angles = message.angle_min + message.angle_increment * np.arange(len(ranges))
        angles = -angles if self._robot.flipped else angles
        limits = float(message.range_min), float(message.range_max)
        scan = LaserScan(stamp, ranges, angles, max(float(message.time_increment), 0.0), *limits, self._robot.T_base_laser)
        if not (np.isfinite(angles).all() and 0.0 <= limits[0] < limits[1] <= LARGEST_VALUE):
            raise ValueError(
                f"a scan from {message.angle_min} rad by {message.angle_increment}, ranges {limits[0]} to {limits[1]} m is none"
            )
        self._first = self._first or scan
        return scan

    def _described(self, scan: LaserScan) -> RobotSpec:
        """A specification of what the bag has."""
        step = float(scan.angles[1] - scan.angles[0]) if len(scan.angles) > 1 else 1.0
        stamps = [event.message.stamp for event in self._events if event.channel == "scans"]
        period = float(np.median(np.diff(stamps))) if len(stamps) > 1 else 0.1
        first = float(scan.angles[0]) if len(scan.angles) else 0.0
        limits = (scan.range_min, scan.range_max, scan.T_base_laser)
        lidar = LidarSpec("unknown", len(scan.ranges), first, step, scan.time_increment, max(period, 1e-3), *limits)
        channels = {event.channel for event in self._events}
        return RobotSpec(
            name=self._path.stem,
            drive=DRIVE if "odometry" in channels else None,
            lidar=lidar,
            imu=ImuSpec("unknown", T_base_imu=self._robot.T_base_imu) if "imu" in channels else None,
            camera=None,
        )


def _message(reader: AnyReader, connection: Connection, raw: bytes) -> Any:
    """A message, of a class that the bag itself defines."""
    return reader.deserialize(raw, connection.msgtype)


def stamp_of(message: Any, arrival: float) -> float:
    """When it was measured [s]; the arrival where the message does not say."""
    header = getattr(message, "header", None)
    stamp = 0.0 if header is None else float(header.stamp.sec) + header.stamp.nanosec / NANOSECONDS
    return arrival if header is None or (stamp == 0.0 and arrival > FIRST_SECOND) else stamp


def _twist(message: Any) -> Twist:
    return Twist(_believable(message.linear.x), _believable(message.angular.z))


def _believable(value: float) -> float:
    if not abs(value) <= LARGEST_VALUE:
        raise ValueError(f"{value} is not finite, or beyond {LARGEST_VALUE:g}")
    return float(value)
