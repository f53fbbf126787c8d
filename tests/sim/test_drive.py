import math

import pytest

from hardware.spec import DriveSpec
from sim.drive import MAX_ACCELERATION, STALL_TIME, Motors, Odometer, RegulatedMotors, Wheels
from sim.drive_errors import DriveErrors
from sim.motion import STEP, Motion
from sim.motor_kernel import PERCENT_RATE, STRENGTH
from slam.messages import Twist
from slam.se3 import SE3

SPEC = DriveSpec()


CARRIED = 4e-4
"""Inertia that a wheel carries [kg m^2]."""


def driven(errors, goal, duration=2.0, load=0.0):
    """Wheel rates [rad/s] and encoder minus wheel angles [rad], a step each, of free wheels under regulated motors."""
    motors, angle, rate, pushed, rates, leads = RegulatedMotors(errors), 0.0, 0.0, 0.0, [], []
    motors.command((goal, goal))
    for _ in range(round(duration / STEP)):
        motors.tick(Wheels((angle, angle), (rate, rate), (pushed + load, pushed + load)))
        change = min(max(motors.rates[0] - rate, -motors.torques[0] * STEP / CARRIED), motors.torques[0] * STEP / CARRIED)
        rate, pushed = rate + change, CARRIED * change / STEP
        angle += rate * STEP
        rates.append(rate)
        leads.append(motors.encoders[0] - angle)
    return rates, leads, motors


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
        motors.tick(Wheels())
    assert motors.rates == (5.0, -3.0)
    assert not motors.tick(Wheels())


def test_motors_are_limited_in_rate_and_acceleration():
    motors = Motors(14.0)
    motors.command((100.0, -100.0))
    before = motors.rates
    for _ in range(1000):
        motors.tick(Wheels())
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


@pytest.mark.parametrize("percent", [-60, -20, 5, 10, 40, 75])
def test_the_regulator_holds_whole_percent_of_full_speed(percent):
    rates, _, _ = driven(DriveErrors(regulator=1.0), percent * PERCENT_RATE)
    assert sum(rates[-250:]) / 250 == pytest.approx(percent * PERCENT_RATE, abs=1.5 * PERCENT_RATE)


def test_one_percent_is_ten_degrees_a_second():
    assert math.degrees(PERCENT_RATE) == pytest.approx(10.07, abs=0.005)


def test_a_motor_cannot_turn_faster_than_its_battery_lets_it():
    rates, _, _ = driven(DriveErrors(regulator=1.0, battery=7.2, battery_empty=7.2), 100 * PERCENT_RATE)
    assert rates[-1] == pytest.approx((7.2 - 0.06 * 5.0) / 0.475, rel=0.01)


def test_nine_volts_and_no_load_give_the_measured_speed_and_current():
    rates, _, motors = driven(DriveErrors(regulator=1.0, battery=9.0, battery_empty=9.0, battery_resistance=1.0, brick_current=0.0), 18.6)
    assert 30.0 / math.pi * rates[-1] == pytest.approx(175.0, rel=0.02)
    assert 9.0 - motors.volts == pytest.approx(2 * 0.06, abs=0.01)


def test_a_regulated_wheel_takes_its_load():
    rates, _, _ = driven(DriveErrors(regulator=1.0), 30 * PERCENT_RATE, load=0.05)
    assert sum(rates[-250:]) / 250 == pytest.approx(30 * PERCENT_RATE, rel=0.04)


def test_too_much_load_stalls_the_motor():
    rates, _, _ = driven(DriveErrors(regulator=1.0), 30 * PERCENT_RATE, load=0.45)
    assert rates[-1] < 0.1


def test_the_battery_empties_and_sags():
    errors = DriveErrors(regulator=1.0, battery_resistance=0.5, battery_capacity=100.0)
    motors = driven(errors, 30 * PERCENT_RATE, duration=3.0)[2]
    rested = RegulatedMotors(errors)
    assert motors.volts < rested.volts - 0.5 * errors.brick_current


def test_a_wheel_follows_its_motor_only_after_the_backlash():
    _, leads, _ = driven(DriveErrors(regulator=1.0, backlash=0.06), 20 * PERCENT_RATE)
    assert leads[-1] == pytest.approx(0.03, abs=0.002)
    _, leads, _ = driven(DriveErrors(regulator=1.0, backlash=0.06), -20 * PERCENT_RATE)
    assert leads[-1] == pytest.approx(-0.03, abs=0.002)
    assert max(abs(lead) for lead in leads) < 0.032


def test_within_the_backlash_only_friction_brakes_the_wheel():
    motors = RegulatedMotors(DriveErrors(regulator=1.0, backlash=0.1, axle_friction=0.002))
    motors.tick(Wheels(rates=(1.0, 1.0)))
    assert motors.torques == (0.002, 0.002)
    firm = RegulatedMotors(DriveErrors(regulator=1.0))
    firm.tick(Wheels(rates=(1.0, 1.0)))
    assert firm.torques == (STRENGTH, STRENGTH)


def test_a_possible_twist_has_wheel_rates_in_whole_percent():
    twist = SPEC.possible(Twist(0.2, 0.37), PERCENT_RATE)
    percents = [rate / PERCENT_RATE for rate in SPEC.wheel_rates(twist)]
    assert percents == pytest.approx([round(percent) for percent in percents], abs=1e-9)
    assert (twist.v, twist.omega) == pytest.approx((0.2, 0.37), abs=0.045)


@pytest.mark.parametrize("twist", [Twist(0.35, 0.0), Twist(0.0, -3.0), Twist(-0.35, 0.1)])
def test_a_possible_twist_stays_within_the_limits(twist):
    rounded = SPEC.possible(SPEC.limit(twist), PERCENT_RATE)
    assert abs(rounded.v) <= SPEC.max_speed
    assert abs(rounded.omega) <= SPEC.max_yaw_rate


def test_perfect_motors_take_any_twist():
    assert SPEC.possible(Twist(0.1234, 0.567), 0.0) == Twist(0.1234, 0.567)
