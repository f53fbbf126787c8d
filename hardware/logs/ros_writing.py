"""Readings to ROS 2 messages."""

from __future__ import annotations

from collections.abc import Iterator
from functools import singledispatch

import numpy as np
from numpy.typing import NDArray

from hardware.hal import Command
from hardware.logs.cdr import encode
from hardware.logs.exact import half_turn, time_of, whole_millimetres
from hardware.logs.ros_types import JOINTS, TOPICS, TRANSFORM
from hardware.spec import RobotSpec
from slam.messages import CameraInfo, Imu, LaserScan, RgbdImage, WheelOdometry
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3

_NOT_MEASURED = (-1.0, *(0.0,) * 8)
"""A covariance that says so (sensor_msgs/Imu)."""

Pixels = NDArray[np.uint8] | NDArray[np.uint16]
Written = Iterator[tuple[str, bytes]]


def text(topic: str, content: str) -> tuple[str, bytes]:
    """A std_msgs/String."""
    return _message(topic, content)


def mounts(spec: RobotSpec, stamp: float) -> tuple[str, bytes]:
    """The sensors' places on `base`, for /tf_static."""
    placed = {"camera": spec.T_base_camera}
    if spec.camera is not None:
        placed["camera_depth"] = spec.camera_infos()[1].T_base_camera
    if spec.lidar is not None:
        placed["laser"] = spec.lidar.T_base_laser
    if spec.imu is not None:
        placed["imu"] = spec.imu.T_base_imu
    values: list[object] = [len(placed)]
    for name, T_base_sensor in placed.items():
        values += [*time_of(stamp), "base", name, _pose3(T_base_sensor)]
    return "/tf_static", encode(" ".join(["I", *[TRANSFORM] * len(placed)]), *values)


def ground_truth(stamp: float, T_world_base: SE2) -> tuple[str, bytes]:
    """The true pose in frame `world`."""
    return _message("/ground_truth", *time_of(stamp), "world", _pose(T_world_base))


@singledispatch
def written(reading: object) -> Written:
    """The (topic, message) pairs that carry one reading."""
    raise TypeError(f"no ROS message carries a {type(reading).__name__}")


@written.register
def _(reading: WheelOdometry) -> Written:
    time = time_of(reading.stamp)
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
    values = np.concatenate([(0.0, 0.0, 0.0, 1.0), _NOT_MEASURED, rate, np.zeros(9), np.zeros(3), _NOT_MEASURED])
    yield _message("/imu", *time_of(reading.stamp), "base", values)


@written.register
def _(reading: LaserScan) -> Written:
    angles, step = reading.angles, float(reading.angles[1] - reading.angles[0]) if len(reading.angles) > 1 else 0.0
    span = reading.time_increment * len(reading.ranges)
    limits = (angles[0], angles[-1], step, reading.time_increment, span, reading.range_min, reading.range_max)
    yield _message("/scan", *time_of(reading.stamp), "laser", limits, reading.ranges, ())


@written.register
def _(reading: RgbdImage) -> Written:
    time, depth_mm = time_of(reading.stamp), whole_millimetres(reading.depth)
    yield _camera_info("/camera/color/camera_info", time, "camera", reading.colour_info)
    yield _camera_info("/camera/depth/camera_info", time, "camera_depth", reading.depth_info)
    yield _image("/camera/color/image_raw", (*time, "camera"), "rgb8", reading.colour)
    yield _image("/camera/depth/image_rect_raw", (*time, "camera_depth"), "16UC1", depth_mm)


@written.register
def _(reading: Command) -> Written:
    yield _message("/cmd_vel", *time_of(reading.stamp), "base", (reading.twist.v, 0.0, 0.0, 0.0, 0.0, reading.twist.omega))


def _image(topic: str, header: tuple[int, int, str], encoding: str, pixels: Pixels) -> tuple[str, bytes]:
    height, width = pixels.shape[:2]
    return _message(topic, *header, height, width, encoding, 0, pixels.nbytes // height, pixels.reshape(-1).view(np.uint8))


def _camera_info(topic: str, time: tuple[int, int], frame: str, info: CameraInfo) -> tuple[str, bytes]:
    projection = np.hstack([info.K, np.zeros((3, 1))])
    values = (info.height, info.width, "plumb_bob", info.D, info.K, np.eye(3), projection)
    return _message(topic, *time, frame, *values, np.zeros(6), 0)


def _pose(T: SE2) -> FloatArray:
    z, w = half_turn(T.yaw)
    return np.array([T.x, T.y, 0.0, 0.0, 0.0, z, w])


def _pose3(T: SE3) -> FloatArray:
    return np.concatenate([T.t, T.quaternion()])


def _message(topic: str, *values: object) -> tuple[str, bytes]:
    return topic, encode(TOPICS[topic].layout, *values)
