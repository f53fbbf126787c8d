"""ROS 2 messages to readings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hardware.hal import Command
from hardware.logs.cdr import decode
from hardware.logs.exact import heading, metres, stamp_of, widened
from hardware.logs.log import LARGEST_VALUE, Reading
from hardware.logs.ros_types import JOINTS, TOPICS
from hardware.spec import RobotSpec
from slam.messages import Imu, LaserScan, RgbdImage, Twist, WheelOdometry
from slam.se2 import SE2, FloatArray


def read_text(message: bytes) -> str:
    """The content of a std_msgs/String."""
    return decode("s", message)[0]


def read_truth(message: bytes) -> tuple[float, SE2]:
    """Stamp [s] and true pose `T_world_base`."""
    seconds, nanosecond, _, pose = decode(TOPICS["/ground_truth"].layout, message)
    return stamp_of(seconds, nanosecond), _se2(pose)


class ReadingDecoder:
    """Readings of one robot from its messages; wheel angles and pose of one stamp are two messages and one reading."""

    def __init__(self, spec: RobotSpec) -> None:
        self._spec = spec
        self._infos = None if spec.camera is None else spec.camera_infos()
        self._wheels: tuple[float, tuple[float, float]] | None = None
        self._colour: tuple[float, NDArray[np.uint8]] | None = None

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
                return "imu", Imu(stamp_of(seconds, nanosecond), _finite("yaw rate", values[15:16])[0])
            case "/cmd_vel":
                seconds, nanosecond, _, values = decode(TOPICS[topic].layout, message)
                return "commands", Command(stamp_of(seconds, nanosecond), _twist(values))
            case _:
                return self._part(topic, message)

    def _part(self, topic: str, message: bytes) -> tuple[str, Reading] | None:
        """What needs more than one message comes with the last of them."""
        if topic == "/joint_states":
            self._joints(message)
        elif topic == "/camera/color/image_raw":
            self._colour = self._picture(topic, message, "rgb8")
        elif topic == "/camera/depth/image_rect_raw":
            return self._images(*self._picture(topic, message, "16UC1"))
        return None

    def _scan(self, message: bytes) -> LaserScan:
        seconds, nanosecond, _, _, ranges, _ = decode(TOPICS["/scan"].layout, message)
        lidar = self._spec.lidar
        if lidar is None or len(ranges) != lidar.beams:
            raise ValueError(f"a scan of {len(ranges)} beams from a robot whose specification says {lidar and lidar.beams}")
        stamp = stamp_of(seconds, nanosecond)
        return LaserScan(stamp, widened(ranges), lidar.angles, lidar.time_increment, lidar.range_min, lidar.range_max, lidar.T_base_laser)

    def _picture(self, topic: str, message: bytes, encoding: str) -> tuple[float, NDArray[np.uint8]]:
        """Stamp [s] and bytes (height, step) of an image as the specification has it."""
        seconds, nanosecond, _, height, width, kind, bigendian, step, content = decode(TOPICS[topic].layout, message)
        if self._infos is None:
            raise ValueError("an image from a robot whose specification has no camera")
        info, size = (self._infos[0], 3) if encoding == "rgb8" else (self._infos[1], 2)
        if (height, width, kind, bigendian, step, len(content)) != (
            info.height,
            info.width,
            encoding,
            0,
            size * width,
            size * width * height,
        ):
            raise ValueError(f"an image of {width} x {height} {kind}; the specification says {info.width} x {info.height} {encoding}")
        return stamp_of(seconds, nanosecond), content.reshape(height, step)

    def _images(self, stamp: float, content: NDArray[np.uint8]) -> tuple[str, RgbdImage] | None:
        """The depth image is the last of a pair; one without its colour image is passed over."""
        colour, self._colour = self._colour, None
        if self._infos is None or colour is None or colour[0] != stamp:
            return None
        depth = metres(content.view("<u2"))
        return "images", RgbdImage(stamp, colour[1].reshape(len(colour[1]), -1, 3), depth, *self._infos)

    def _odometry(self, message: bytes) -> WheelOdometry:
        seconds, nanosecond, _, _, values = decode(TOPICS["/odom"].layout, message)
        stamp = stamp_of(seconds, nanosecond)
        wheels = self._wheels[1] if self._wheels is not None and self._wheels[0] == stamp else None
        return WheelOdometry(stamp, _se2(values), _twist(values[43:49]), wheels)

    def _joints(self, message: bytes) -> None:
        seconds, nanosecond, _, names, positions, _, _ = decode(TOPICS["/joint_states"].layout, message)
        angles = dict(zip(names, positions.tolist(), strict=False))
        if all(joint in angles for joint in JOINTS):
            self._wheels = stamp_of(seconds, nanosecond), (angles[JOINTS[0]], angles[JOINTS[1]])


def _se2(values: FloatArray) -> SE2:
    x, y, _, _, _, z, w = _finite("pose", values[:7])
    return SE2(x, y, heading(z, w))


def _twist(values: FloatArray) -> Twist:
    v, _, _, _, _, omega = _finite("twist", values[:6])
    return Twist(v, omega)


def _finite(what: str, values: FloatArray) -> list[float]:
    if not (np.abs(values) <= LARGEST_VALUE).all():
        raise ValueError(f"the {what} {values.tolist()} is not finite, or beyond {LARGEST_VALUE:g}")
    return values.tolist()
