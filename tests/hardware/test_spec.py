import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware.camera_spec import camera_mount
from hardware.errors import SpecError
from hardware.spec import DriveSpec, LidarSpec, RobotSpec
from slam.messages import Twist
from slam.se2 import SE2

DRIVE = DriveSpec()
UNEVEN = DriveSpec(wheel_radii=(0.027, 0.029), track=0.13)
twists = st.builds(Twist, st.floats(-2.0, 2.0), st.floats(-20.0, 20.0))
turns = st.floats(-30.0, 30.0)


@given(twists)
def test_wheel_rates_and_twist_undo_each_other(twist: Twist) -> None:
    back = UNEVEN.twist(*UNEVEN.wheel_rates(twist))
    assert (back.v, back.omega) == pytest.approx((twist.v, twist.omega), abs=1e-9)


@given(turns, turns)
def test_an_increment_is_the_arc_of_its_twist(left: float, right: float) -> None:
    twist = UNEVEN.twist(left, right)
    expected = SE2.exp(np.array([twist.v, 0.0, twist.omega]))
    np.testing.assert_allclose(UNEVEN.increment(left, right).matrix(), expected.matrix(), atol=1e-9)


@settings(max_examples=30)
@given(turns, turns)
def test_an_arc_is_the_same_in_one_step_and_in_many(left: float, right: float) -> None:
    pose = SE2()
    for _ in range(50):
        pose = pose @ DRIVE.increment(left / 50, right / 50)
    np.testing.assert_allclose(pose.matrix(), DRIVE.increment(left, right).matrix(), atol=1e-9)


def test_a_turn_of_both_wheels_goes_straight_by_their_circumference() -> None:
    increment = DRIVE.increment(math.tau, math.tau)
    assert (increment.x, increment.y, increment.yaw) == pytest.approx((math.tau * 0.028, 0.0, 0.0))


def test_the_right_wheel_alone_turns_the_robot_to_the_left() -> None:
    assert DRIVE.increment(0.0, 1.0).yaw == pytest.approx(0.028 / 0.120)


@given(twists)
def test_a_limited_twist_keeps_every_limit(twist: Twist) -> None:
    limited = DRIVE.limit(twist)
    assert abs(limited.v) <= DRIVE.max_speed
    assert abs(limited.omega) <= DRIVE.max_yaw_rate
    assert max(map(abs, DRIVE.wheel_rates(limited))) <= DRIVE.max_wheel_rate * (1.0 + 1e-9)


@given(st.floats(-0.1, 0.1), st.floats(-1.0, 1.0))
def test_a_twist_within_the_limits_is_obeyed_as_it_is(v: float, omega: float) -> None:
    assert DRIVE.limit(Twist(v, omega)) == Twist(v, omega)


@given(st.floats(0.01, 0.35), st.floats(-3.0, 3.0))
def test_a_wheel_at_its_limit_keeps_the_curvature(v: float, omega: float) -> None:
    limited = DriveSpec(max_wheel_rate=2.0).limit(Twist(v, omega))
    assert limited.omega * v == pytest.approx(omega * limited.v, abs=1e-12)


@pytest.mark.parametrize("twist", [Twist(math.nan, 0.0), Twist(0.1, math.inf), Twist(-math.inf, 0.0)])
def test_a_command_that_is_not_finite_stops(twist: Twist) -> None:
    assert DRIVE.limit(twist) == Twist()


@pytest.mark.parametrize(
    "values", [{"track": 0.0}, {"wheel_radii": (0.028, -0.028)}, {"counts_per_turn": 0}, {"period": math.nan}, {"max_speed": math.inf}]
)
def test_an_impossible_drive_is_refused(values: dict[str, object]) -> None:
    with pytest.raises(SpecError, match="finite and positive"):
        DriveSpec(**values)


def test_the_default_lidar_is_the_urg() -> None:
    angles = LidarSpec().angles
    assert len(angles) == 682
    assert math.degrees(angles[0]) == pytest.approx(-119.53, abs=0.01)
    assert math.degrees(angles[-1]) == pytest.approx(119.88, abs=0.01)
    assert angles[340] == pytest.approx(0.0, abs=1e-12)
    assert np.diff(angles) == pytest.approx(math.tau / 1024)


def test_a_robot_names_the_sensors_that_it_has() -> None:
    assert RobotSpec().available == {"odometry", "scans", "imu", "images"}
    assert RobotSpec(imu=None, camera=None).available == {"odometry", "scans"}
    assert RobotSpec(drive=None, lidar=None, imu=None, camera=None).available == set()


def test_a_camera_that_looks_ahead_has_its_axis_along_x_and_its_right_along_minus_y() -> None:
    T_base_camera = camera_mount((0.1, 0.0, 0.2), 0.0)
    np.testing.assert_allclose(T_base_camera.R @ [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(T_base_camera.R @ [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], atol=1e-12)
    np.testing.assert_array_equal(T_base_camera.t, [0.1, 0.0, 0.2])


def test_a_camera_pitched_up_looks_up() -> None:
    axis = camera_mount((0.0, 0.0, 0.0), math.radians(15.0)).R @ [0.0, 0.0, 1.0]
    np.testing.assert_allclose(axis, [math.cos(math.radians(15.0)), 0.0, math.sin(math.radians(15.0))], atol=1e-12)
