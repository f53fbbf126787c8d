"""Every reading comes back bit for bit from the messages that carry it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.hal import Command
from hardware.logs.ros_reading import ReadingDecoder, read_truth
from hardware.logs.ros_writing import ground_truth, written
from hardware.spec import RobotSpec
from slam.messages import Imu, LaserScan, Twist, WheelOdometry
from slam.se2 import SE2

NANOS = st.integers(0, 10**15)
METRES = st.floats(-1e3, 1e3)
HEADINGS = st.floats(-math.pi, math.pi, exclude_min=True).filter(lambda yaw: yaw == 0.0 or abs(yaw) > 1e-300)


def back(reading):
    decoder = ReadingDecoder(RobotSpec())
    found = [decoder.read(topic, message) for topic, message in written(reading)]
    return next(item[1] for item in found if item is not None)


@given(NANOS, METRES, METRES, HEADINGS, METRES, METRES, METRES, METRES)
def test_odometry_comes_back_bit_for_bit(nanos, x, y, yaw, v, omega, left, right):
    reading = WheelOdometry(nanos / 10**9, SE2(x, y, yaw), Twist(v, omega), (left, right))
    assert back(reading) == reading


def test_odometry_without_encoders_comes_back_without():
    reading = WheelOdometry(1.5, SE2(1.0, 2.0, 3.0))
    assert back(reading) == reading


def test_wheel_angles_of_another_stamp_are_not_attached():
    decoder = ReadingDecoder(RobotSpec())
    joints = next(iter(written(WheelOdometry(1.0, SE2(), Twist(), (1.0, 2.0)))))
    decoder.read(*joints)
    odometry = [message for message in written(WheelOdometry(1.02, SE2())) if message[0] == "/odom"]
    assert decoder.read(*odometry[0])[1].wheel_angles is None


@given(NANOS, METRES)
def test_a_gyro_reading_comes_back_bit_for_bit(nanos, rate):
    assert back(Imu(nanos / 10**9, rate)) == Imu(nanos / 10**9, rate)


@given(NANOS, METRES, METRES)
def test_a_command_comes_back_bit_for_bit(nanos, v, omega):
    assert back(Command(nanos / 10**9, Twist(v, omega))) == Command(nanos / 10**9, Twist(v, omega))


@given(NANOS, METRES, METRES, HEADINGS)
def test_the_truth_comes_back_bit_for_bit(nanos, x, y, yaw):
    assert read_truth(ground_truth(nanos / 10**9, SE2(x, y, yaw))[1]) == (nanos / 10**9, SE2(x, y, yaw))


def scan(ranges) -> LaserScan:
    lidar = RobotSpec().lidar
    return LaserScan(0.1043, ranges, lidar.angles, lidar.time_increment, lidar.range_min, lidar.range_max, lidar.T_base_laser)


def test_whole_millimetres_come_back_bit_for_bit():
    for ranges in np.arange(100 * 682).reshape(100, 682) / 1000.0:
        assert np.array_equal(back(scan(ranges)).ranges, ranges)


def test_other_ranges_come_back_to_float32():
    ranges = np.random.default_rng(0).uniform(0.02, 5.6, 682)
    assert np.allclose(back(scan(ranges)).ranges, ranges, rtol=1e-7, atol=0.0)


def test_infinities_and_nan_come_back():
    ranges = np.full(682, 1.0)
    ranges[:3] = np.inf, -np.inf, np.nan
    assert np.array_equal(back(scan(ranges)).ranges, ranges, equal_nan=True)


def test_a_scan_has_the_angles_timing_and_mount_of_its_robot():
    found, lidar = back(scan(np.ones(682))), RobotSpec().lidar
    assert np.array_equal(found.angles, lidar.angles)
    assert (found.time_increment, found.range_max, found.T_base_laser) == (lidar.time_increment, lidar.range_max, lidar.T_base_laser)


def test_a_scan_of_another_lidar_is_refused():
    message = next(iter(written(LaserScan(0.0, np.ones(3), np.arange(3.0), 0.0, 0.0, 1.0))))
    with pytest.raises(ValueError, match="3 beams from a robot whose specification says 682"):
        ReadingDecoder(RobotSpec()).read(*message)


def test_a_pose_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="not finite"):
        back(WheelOdometry(0.0, SE2(math.nan, 0.0, 0.0)))
