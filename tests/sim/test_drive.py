import math

import pytest

from hardware.spec import DriveSpec
from sim.drive import MAX_ACCELERATION, STALL_TIME, Motors, Odometer
from sim.motion import STEP, Motion
from slam.se3 import SE3

SPEC = DriveSpec()


def spun(rates, duration=1.0):
    """A motion whose wheels turn at constant rates (left, right) [rad/s]."""
    motion = Motion(0, SE3())
    motion.append(
        [(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, rates[0] * k * STEP, rates[1] * k * STEP) for k in range(round(duration / STEP) + 1)]
    )
    return motion


def readings(motion, rates):
    odometer, result = Odometer(SPEC), []
    while odometer.due <= motion.end:
        result.append(odometer.read(motion, rates))
    return odometer, result


def test_motors_reach_the_commanded_rates():
    motors = Motors(14.0)
    motors.command((5.0, -3.0))
    for _ in range(500):
        motors.tick()
    assert motors.rates == (5.0, -3.0)
    assert not motors.tick()


def test_motors_are_limited_in_rate_and_acceleration():
    motors = Motors(14.0)
    motors.command((100.0, -100.0))
    before = motors.rates
    for _ in range(1000):
        motors.tick()
        assert abs(motors.rates[0] - before[0]) <= MAX_ACCELERATION * STEP + 1e-12
        before = motors.rates
    assert motors.rates == (14.0, -14.0)


def test_odometry_counts_whole_degrees():
    _, result = readings(spun((3.0, 3.3)), (3.0, 3.3))
    for reading in result:
        degrees = [math.degrees(angle) for angle in reading.wheel_angles]
        assert degrees == pytest.approx([round(angle) for angle in degrees], abs=1e-9)
        assert degrees == pytest.approx([math.degrees(3.0 * reading.stamp), math.degrees(3.3 * reading.stamp)], abs=0.51)


def test_odometry_integrates_with_the_specified_radii():
    _, result = readings(spun((5.0, 5.0)), (5.0, 5.0))
    assert result[-1].T_odom_base.x == pytest.approx(5.0 * 0.028, abs=0.0005)
    assert result[-1].T_odom_base.yaw == 0.0


def test_odometry_comes_at_its_own_times():
    _, result = readings(spun((1.0, 1.0)), (1.0, 1.0))
    assert [reading.stamp for reading in result] == [round(k * SPEC.period, 9) for k in range(51)]


def test_a_wheel_that_should_turn_and_does_not_is_stalled():
    assert readings(spun((0.0, 5.0)), (5.0, 5.0))[0].stalled


def test_a_wheel_that_stands_as_told_is_not_stalled():
    assert not readings(spun((0.0, 5.0)), (0.0, 5.0))[0].stalled


def test_a_stall_ends_with_the_next_edge():
    motion = spun((0.0, 0.0), STALL_TIME + 0.1)
    odometer, _ = readings(motion, (5.0, 5.0))
    assert odometer.stalled
    motion.append([(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0) for _ in range(10)])
    odometer.read(motion, (5.0, 5.0))
    assert not odometer.stalled
