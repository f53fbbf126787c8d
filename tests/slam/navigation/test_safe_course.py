import math

import numpy as np
import pytest

from slam.errors import ParameterError
from slam.messages import LaserScan, SensorFrame, Twist
from slam.navigation.safe_course import HEADINGS, SafeCourse, room
from slam.se2 import SE2

ANGLES = np.radians(np.arange(-120.0, 120.5, 1.0))
PERIOD = 0.1


def scan_in_room(pose: SE2, stamp: float, half: float = 2.0) -> LaserScan:
    """What is seen from a pose inside a square of this half side [m] about the origin."""
    bearings = pose.yaw + ANGLES
    with np.errstate(divide="ignore"):
        x = np.where(np.cos(bearings) > 0.0, half - pose.x, -half - pose.x) / np.cos(bearings)
        y = np.where(np.sin(bearings) > 0.0, half - pose.y, -half - pose.y) / np.sin(bearings)
    return LaserScan(stamp, np.minimum(x, y), ANGLES, 0.0, 0.0, 5.6)


def test_a_robot_in_a_room_keeps_moving_and_touches_nothing() -> None:
    policy, pose, path = SafeCourse().build(), SE2(0.3, -0.4, 0.7), []
    for k in range(1200):
        twist = policy(SensorFrame(PERIOD * k, scans=(scan_in_room(pose, PERIOD * k),)))
        pose = pose @ SE2.exp(np.array([twist.v, 0.0, twist.omega]) * PERIOD)
        path.append((pose.x, pose.y))
    assert np.abs(path).max() < 2.0 - SafeCourse().half_width
    assert np.ptp(path, axis=0).max() > 1.5


def test_in_front_of_a_wall_it_turns_on_the_spot_to_one_side() -> None:
    policy, pose = SafeCourse().build(), SE2(1.7, 0.0, 0.1)
    turns = []
    for k in range(10):
        twist = policy(SensorFrame(PERIOD * k, scans=(scan_in_room(pose, PERIOD * k),)))
        assert twist.v == 0.0
        turns.append(twist.omega)
        pose = pose @ SE2.exp(np.array([0.0, 0.0, twist.omega]) * PERIOD)
    assert len(set(turns)) == 1


def test_between_two_scans_the_command_stays_and_without_any_it_stops() -> None:
    policy = SafeCourse().build()
    first = policy(SensorFrame(0.0, scans=(scan_in_room(SE2(), 0.0),)))
    assert first.v > 0.0
    assert policy(SensorFrame(0.2)) == first
    assert policy(SensorFrame(0.9)) == Twist(0.0, 0.0)


def test_a_way_is_as_long_as_its_strip_is_free() -> None:
    rooms = room(np.array([[1.0, 0.1], [0.5, 0.5]]), 0.2)
    assert rooms[len(HEADINGS) // 2] == pytest.approx(1.0)
    assert math.isinf(rooms[0])


def test_a_course_of_no_width_is_refused() -> None:
    with pytest.raises(ParameterError):
        SafeCourse(half_width=0.0)
