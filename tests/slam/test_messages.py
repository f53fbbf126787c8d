import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.messages import Estimate, Imu, LaserScan, SensorFrame, Status, Trajectory, Twist, WheelOdometry, read_only
from slam.se2 import SE2
from slam.se3 import SE3

SCAN = LaserScan(1.0, np.ones(3), np.zeros(3), 0.1, 0.02, 5.6)
MESSAGES = [
    Twist(),
    SCAN,
    WheelOdometry(0.0, SE2()),
    Imu(0.0, 0.0),
    SensorFrame(0.0),
    Estimate(0.0, SE2(), SE2(), np.eye(3)),
    Trajectory(np.zeros(1), np.zeros((1, 3))),
    SE2(),
    SE3(),
]


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_a_message_is_frozen(message: object) -> None:
    for field in dataclasses.fields(message):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(message, field.name, None)


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_no_array_of_a_message_can_be_written(message: object) -> None:
    for field in dataclasses.fields(message):
        value = getattr(message, field.name)
        assert not isinstance(value, np.ndarray) or not value.flags.writeable


def test_a_message_keeps_its_own_copy() -> None:
    ranges, covariance, poses = np.ones(3), np.eye(3), np.zeros((1, 3))
    scan = LaserScan(0.0, ranges, np.zeros(3), 0.0, 0.02, 5.6)
    estimate = Estimate(0.0, SE2(), SE2(), covariance)
    trajectory = Trajectory(np.zeros(1), poses)
    ranges[0], covariance[0, 0], poses[0, 0] = 7.0, 7.0, 7.0
    assert scan.ranges[0] == 1.0
    assert estimate.covariance[0, 0] == 1.0
    assert trajectory.poses[0, 0] == 0.0


@given(st.lists(st.floats(allow_nan=False), max_size=8))
def test_read_only_keeps_the_values_as_float64(values: list[float]) -> None:
    frozen = read_only(values)
    assert frozen.dtype == np.float64
    assert frozen.tolist() == values


def test_a_scan_ends_with_its_last_beam() -> None:
    assert SCAN.end == pytest.approx(1.2)


def test_a_scan_without_beams_ends_when_it_starts() -> None:
    assert LaserScan(1.0, np.empty(0), np.empty(0), 0.1, 0.02, 5.6).end == 1.0


def test_a_scan_keeps_infinite_and_invalid_ranges() -> None:
    ranges = LaserScan(0.0, np.array([np.inf, -np.inf, np.nan]), np.zeros(3), 0.0, 0.02, 5.6).ranges
    np.testing.assert_array_equal(ranges, [np.inf, -np.inf, np.nan])


def test_a_trajectory_is_shaped_when_it_is_empty() -> None:
    trajectory = Trajectory(np.empty(0), np.empty(0))
    assert len(trajectory) == 0
    assert trajectory.poses.shape == (0, 3)


def test_an_estimate_tracks_unless_it_says_otherwise() -> None:
    estimate = Estimate(0.0, SE2(), SE2(), np.eye(3))
    assert (estimate.status, estimate.health, estimate.reason) == (Status.TRACKING, 1.0, "")
