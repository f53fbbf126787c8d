import math

import numpy as np
import pytest

from slam.messages import Imu, WheelOdometry
from slam.motion.dead_reckoning import HISTORY, SILENCE, STANDSTILL, DeadReckoning
from slam.se2 import SE2

PERIOD, GYRO_PERIOD = 0.02, 0.01


def wheels(v: float, omega: float, start: float, end: float, origin: SE2 | None = None) -> list[WheelOdometry]:
    """Wheel odometry at a constant twist."""
    stamps = start + PERIOD * np.arange(round((end - start) / PERIOD) + 1)
    return [WheelOdometry(t, (origin or SE2()) @ SE2.exp(np.array([v, 0.0, omega]) * (t - start))) for t in stamps]


def gyro(rate: float, start: float, end: float) -> list[Imu]:
    return [Imu(t, rate) for t in start + GYRO_PERIOD * np.arange(round((end - start) / GYRO_PERIOD) + 1)]


def assert_pose(pose: SE2, expected: SE2, tolerance: float = 1e-9) -> None:
    np.testing.assert_allclose(pose.matrix(), expected.matrix(), atol=tolerance)


def test_before_any_reading_there_is_no_motion() -> None:
    motion = DeadReckoning()
    assert motion.empty
    assert motion.newest == -math.inf
    assert motion.pose_at(3.0) == SE2()
    assert len(motion.window(0.0)) == 0


def test_wheels_alone_are_passed_on() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.5, 0.0, 1.0), [])
    assert_pose(motion.pose_at(1.0), SE2.exp(np.array([0.2, 0.0, 0.5])))
    assert_pose(motion.wheels, SE2.exp(np.array([0.2, 0.0, 0.5])))


def test_the_first_pose_is_the_wheels_own() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.0, 0.0, 1.0, SE2(5.0, 4.0, 1.0)), [])
    assert_pose(motion.pose_at(0.0), SE2(5.0, 4.0, 1.0))


def test_readings_may_come_in_any_portions() -> None:
    whole, pieces = DeadReckoning(), DeadReckoning()
    readings, rates = wheels(0.2, 0.5, 0.0, 1.0), gyro(0.6, 0.0, 1.0)
    whole.add(readings, rates)
    for k in range(len(readings)):
        pieces.add(readings[k : k + 1], [rate for rate in rates if readings[k].stamp - PERIOD < rate.stamp <= readings[k].stamp])
    assert_pose(pieces.pose_at(1.0), whole.pose_at(1.0), 1e-4)


def test_with_a_gyro_the_heading_is_the_gyros_and_the_way_the_wheels() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.5, 0.0, 1.0), gyro(0.7, 0.0, 1.0))
    assert_pose(motion.pose_at(1.0), SE2.exp(np.array([0.2, 0.0, 0.7])), 1e-6)


def test_the_wheels_own_pose_does_not_follow_the_gyro() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.5, 0.0, 1.0), gyro(0.7, 0.0, 1.0))
    assert_pose(motion.wheels, SE2.exp(np.array([0.2, 0.0, 0.5])))


def test_a_gyros_bias_is_learned_while_the_robot_stands() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.0, 0.0, 0.0, 2.0), gyro(0.05, 0.0, 2.0))
    before = motion.pose_at(2.0)
    motion.add(wheels(0.2, 0.5, 2.0, 3.0)[1:], gyro(0.55, 2.0 + GYRO_PERIOD, 3.0))
    assert (before.inverse() @ motion.pose_at(3.0)).yaw == pytest.approx(0.5, abs=5e-3)  # half a gyro period at the jump


def test_a_gyros_bias_is_not_learned_from_motion() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.5, 0.0, 2.0), gyro(0.55, 0.0, 2.0))
    assert motion.pose_at(2.0).yaw == pytest.approx(1.1, abs=1e-6)


def test_a_short_stop_teaches_nothing() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.0, 0.0, 1.0), gyro(0.1, 0.0, 1.0))
    stopped = wheels(0.0, 0.0, 1.0, 1.0 + 0.5 * STANDSTILL, motion.wheels)[1:]
    motion.add(stopped, gyro(0.1, 1.01, stopped[-1].stamp))
    assert motion.pose_at(stopped[-1].stamp).yaw == pytest.approx(0.1 * stopped[-1].stamp, abs=1e-6)


def test_when_the_gyro_falls_silent_the_wheels_give_the_heading() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.5, 0.0, 3.0), gyro(0.7, 0.0, 1.0))
    assert motion.pose_at(1.0).yaw == pytest.approx(0.7, abs=1e-6)
    assert (motion.pose_at(1.2).inverse() @ motion.pose_at(3.0)).yaw == pytest.approx(0.9, abs=1e-6)


def test_a_gap_in_the_gyro_is_bridged_by_the_wheels() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.5, 0.0, 3.0), [*gyro(0.7, 0.0, 1.0), *gyro(0.7, 2.0, 3.0)])
    assert motion.pose_at(3.0).yaw == pytest.approx(0.7 + 0.5 + 0.7, abs=0.05)


def test_between_readings_the_pose_lies_on_the_arc() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 2.0, 0.0, 1.0), [])
    assert_pose(motion.pose_at(0.507), SE2.exp(np.array([0.2, 0.0, 2.0]) * 0.507))


@pytest.mark.parametrize(("t", "held"), [(-5.0, 0.0), (-math.inf, 0.0), (7.0, 1.0 + SILENCE)])
def test_beyond_the_readings_the_pose_is_held(t: float, held: float) -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.5, 0.0, 1.0), [])
    assert_pose(motion.pose_at(t), SE2.exp(np.array([0.2, 0.0, 0.5]) * held))


def test_for_a_moment_after_the_newest_reading_the_motion_goes_on() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.5, 0.0, 1.0), [])
    assert_pose(motion.pose_at(1.03), SE2.exp(np.array([0.2, 0.0, 0.5]) * 1.03))


def test_the_gyro_turns_the_pose_before_the_next_wheel_reading_comes() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.5, 0.0, 1.0), [*gyro(0.5, 0.0, 1.0), Imu(1.01, 0.9), Imu(1.02, 0.9)])
    assert motion.pose_at(1.02).yaw == pytest.approx(0.5 + 0.01 * 0.7 + 0.01 * 0.9, abs=1e-6)


def test_slow_odometry_is_held() -> None:
    motion = DeadReckoning()
    motion.add([WheelOdometry(0.0, SE2()), WheelOdometry(1.0, SE2(0.5))], [])
    assert motion.pose_at(1.05) == SE2(0.5)


def test_the_motion_of_a_reading_that_is_not_newer_is_part_of_the_next() -> None:
    motion = DeadReckoning()
    motion.add([WheelOdometry(0.0, SE2()), WheelOdometry(1.0, SE2(1.0)), WheelOdometry(1.0, SE2(1.5)), WheelOdometry(2.0, SE2(2.0))], [])
    assert_pose(motion.pose_at(1.0), SE2(1.0))
    assert_pose(motion.pose_at(2.0), SE2(2.0))


def test_a_reset_of_the_odometry_is_no_motion(caplog: pytest.LogCaptureFixture) -> None:
    motion = DeadReckoning()
    motion.add([WheelOdometry(0.0, SE2()), WheelOdometry(0.1, SE2(0.1)), WheelOdometry(0.2, SE2(50.0)), WheelOdometry(0.3, SE2(50.1))], [])
    assert_pose(motion.pose_at(0.3), SE2(0.2))
    assert "taken as a reset" in caplog.text


def test_a_window_begins_with_the_last_pose_before_it() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.0, 0.0, 1.0), [])
    window = motion.window(0.51)
    np.testing.assert_allclose(window.stamps[:2], [0.5, 0.52])
    assert window.stamps[-1] == pytest.approx(1.0)


def test_the_past_is_kept_for_a_while_and_then_forgotten() -> None:
    motion = DeadReckoning()
    motion.add(wheels(0.2, 0.0, 0.0, 10.0), gyro(0.0, 0.0, 10.0))
    stamps = motion.window(-math.inf).stamps
    assert HISTORY <= 10.0 - stamps[0] <= HISTORY + 2 * PERIOD
