import math

import pytest

from hardware.hal import WATCHDOG, Recorded, Resettable
from slam.messages import Twist


def speed(robot):
    frame = robot.read()
    recent = [reading.twist.v for reading in frame.odometry[-10:]]
    return sum(recent) / len(recent)


def test_time_lands_where_it_is_told_to(driven, live):
    with driven as robot:
        start = robot.clock.now()
        for t in (0.1, 0.10001, 0.5 / 3.0, 1.0):
            assert robot.clock.sleep_until(start + t)
            assert robot.clock.now() >= start + t if live(robot) else robot.clock.now() == start + t


def test_sleeping_into_the_past_changes_nothing(driven, live):
    with driven as robot:
        start = robot.clock.now()
        robot.clock.sleep_until(start + 0.5)
        assert robot.clock.sleep_until(start + 0.2)
        assert robot.clock.now() >= start + 0.5 if live(robot) else robot.clock.now() == 0.5


STEP_V, STEP_OMEGA = 0.0025, 0.042
"""Half a percent of an EV3 motor's full speed, on both wheels: a body may round what it is told by this much [m/s, rad/s]."""


def test_a_command_beyond_the_limits_is_clipped_and_reported(driven):
    with driven as robot:
        drive = robot.spec.drive
        commanded = robot.drive(Twist(10.0, 0.0))
        assert commanded.v == pytest.approx(drive.limit(Twist(10.0, 0.0)).v, abs=2.0 * STEP_V)
        assert 0.0 < commanded.v <= drive.max_speed
        assert robot.drive(Twist(0.0, -50.0)).omega >= -drive.max_yaw_rate


def test_a_command_within_the_limits_is_kept_but_for_rounding(driven):
    with driven as robot:
        commanded = robot.drive(Twist(0.1, 0.2))
        assert commanded.v == pytest.approx(0.1, abs=STEP_V)
        assert commanded.omega == pytest.approx(0.2, abs=STEP_OMEGA)
        assert robot.drive(commanded) == commanded


@pytest.mark.parametrize("broken", [Twist(math.nan, 0.0), Twist(0.1, math.inf)])
def test_a_command_that_is_not_finite_stops(driven, broken):
    with driven as robot:
        assert robot.drive(broken) == Twist()


def test_what_is_really_commanded_is_in_the_queue(driven):
    commands = driven.queues["commands"].subscribe()
    with driven as robot:
        robot.clock.sleep_until(robot.clock.now() + 0.25)
        before = robot.clock.now()
        commanded = robot.drive(Twist(10.0, 0.0))
        assert before <= robot.queues["commands"].latest.stamp <= robot.clock.now()
        assert [command.twist for command in commands.take()] == [commanded]


def test_the_watchdog_stops_a_robot_without_fresh_commands(driven):
    with driven as robot:
        start = robot.clock.now()
        robot.drive(Twist(0.1, 0.0))
        robot.clock.sleep_until(start + WATCHDOG - 0.02)
        assert speed(robot) == pytest.approx(0.1, abs=0.02)
        robot.clock.sleep_until(start + WATCHDOG + 0.7)
        assert speed(robot) == 0.0


def test_fresh_commands_keep_the_watchdog_away(driven):
    with driven as robot:
        start = robot.clock.now()
        for k in range(5):
            robot.clock.sleep_until(start + 0.4 * k)
            robot.drive(Twist(0.1, 0.0))
            robot.read()
        robot.clock.sleep_until(start + 1.9)
        assert speed(robot) == pytest.approx(0.1, abs=0.02)


def test_the_watchdogs_stop_is_a_command_too(driven):
    commands = driven.queues["commands"].subscribe()
    with driven as robot:
        commanded = robot.drive(Twist(0.1, 0.0))
        robot.clock.sleep_until(robot.clock.now() + 1.0)
    assert [command.twist for command in commands.take()] == [commanded, Twist()]


def test_a_reset_body_is_at_its_start_again(case):
    robot = case.make()
    if not isinstance(robot, Resettable):
        pytest.skip("not a twin")
    with robot:
        robot.drive(Twist(0.2, 0.0))
        robot.clock.sleep_until(0.5)
        robot.reset(3)
        assert robot.clock.now() == 0.0
        robot.clock.sleep_until(0.2)
        frame = robot.read()
    assert frame.odometry[0].stamp == 0.0
    assert frame.odometry[-1].T_odom_base.x == 0.0


def test_a_recording_is_not_driven(case):
    robot = case.make()
    if not isinstance(robot, Recorded):
        pytest.skip("not a recording")
    with robot:
        while robot.clock.now() < 1.0:
            robot.clock.sleep_until(1.0)
        recorded = robot.drive(Twist(0.3, 0.3))
        assert (recorded.v, recorded.omega) == pytest.approx((0.1, 0.0), abs=STEP_V)
