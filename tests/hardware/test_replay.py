"""A recording as a robot."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hardware.errors import NotOpenError, RecordingError, SpecError
from hardware.hal import Command, Recorded
from hardware.logs.log import Event
from hardware.registry import backend_class
from hardware.replay import Replay
from hardware.spec import RobotSpec
from slam.messages import Imu, LaserScan, Twist, WheelOdometry
from slam.se2 import SE2


def odometry(arrival, stamp=None):
    stamp = arrival if stamp is None else stamp
    return Event(arrival, "odometry", WheelOdometry(stamp, SE2(stamp, 0.0, 0.0), Twist(0.1, 0.0)))


def scan(arrival, stamp, time_increment=0.0):
    return Event(arrival, "scans", LaserScan(stamp, np.ones(11), np.arange(11.0), time_increment, 0.0, 5.0))


def stamps(readings):
    return [reading.stamp for reading in readings]


def read_all(body, step=math.inf):
    """(clock, odometry stamps, scan stamps) of every frame."""
    frames, t = [], body.clock.now()
    with body:
        while body.clock.sleep_until(t):
            frame = body.read()
            frames.append((body.clock.now(), stamps(frame.odometry), stamps(frame.scans)))
            t += step
    return frames


def test_the_clock_starts_at_the_first_reading_and_goes_from_one_to_the_next(make_body):
    body = make_body([odometry(5.0), odometry(5.5), odometry(7.0)])
    assert body.clock.now() == 5.0
    assert read_all(body) == [(5.0, [5.0], []), (5.5, [5.5], []), (7.0, [7.0], [])]


def test_the_clock_stops_at_t_before_the_next_reading(make_body):
    with make_body([odometry(0.0), odometry(1.0)]) as body:
        assert body.clock.sleep_until(0.25)
        assert body.clock.now() == 0.0
        assert body.clock.sleep_until(0.25)
        assert body.clock.now() == 0.25
        body.read()
        assert body.read().odometry == ()


def test_after_the_last_reading_there_is_no_more(make_body):
    with make_body([odometry(0.0), odometry(1.0)]) as body:
        assert [body.clock.sleep_until(9.0) for _ in range(3)] == [True, True, False]
        assert body.clock.now() == 1.0


def test_a_long_silence_is_jumped_over(make_body):
    body = make_body([odometry(0.0), odometry(9.0), odometry(1000.0)])
    assert [frame[0] for frame in read_all(body, 4.0)] == [0.0, 4.0, 8.0, 9.0, 1000.0]


def test_time_never_runs_back(make_body):
    with make_body([odometry(1.0), odometry(2.0), odometry(3.0)]) as body:
        body.clock.sleep_until(2.0)
        body.clock.sleep_until(2.0)
        assert body.clock.sleep_until(0.0)
        assert body.clock.now() == 2.0


def test_a_scan_waits_for_the_odometry_of_its_last_beam(make_body):
    body = make_body([odometry(0.0), scan(0.2, 0.1, 0.01), odometry(0.3, 0.15), odometry(0.4, 0.2), odometry(0.5)])
    assert [frame[2] for frame in read_all(body)] == [[], [], [], [0.1], []]


def test_scans_are_released_at_the_end_of_the_recording(make_body):
    assert read_all(make_body([odometry(0.0), scan(0.5, 0.4), scan(0.6, 0.5)])) == [(0.0, [0.0], []), (0.5, [], []), (0.6, [], [0.4, 0.5])]


def test_scans_are_not_held_for_odometry_that_stays_away(make_body):
    body = make_body([odometry(0.0), scan(0.5, 0.4), scan(1.5, 1.3), scan(2.5, 2.3), odometry(9.0)])
    assert [frame[2] for frame in read_all(body)] == [[], [], [0.4], [1.3], [2.3]]


def test_scans_are_not_held_on_a_body_without_odometry(make_body):
    body = make_body([scan(0.0, 0.0), scan(1.0, 1.0)], replace(RobotSpec(), drive=None))
    assert [frame[2] for frame in read_all(body)] == [[0.0], [1.0]]


def test_drive_returns_the_recorded_command(make_body):
    command = Event(0.5, "commands", Command(0.5, Twist(0.3, -0.2)))
    with make_body([odometry(0.0), command, odometry(1.0)]) as body:
        body.clock.sleep_until(0.0)
        assert body.drive(Twist(9.0, 9.0)) == Twist(0.1, 0.0)
        body.clock.sleep_until(0.5)
        assert body.drive(Twist(9.0, 9.0)) == Twist(0.3, -0.2)


def test_opening_again_starts_from_the_first_reading(make_body):
    body = make_body([odometry(0.0), scan(0.1, 0.05), Event(0.2, "commands", Command(0.2, Twist(1.0, 0.0))), odometry(1.0)])
    assert read_all(body) == read_all(body)
    with body:
        assert body.drive(Twist()) == Twist()


def test_outside_open_and_close_it_refuses(make_body):
    body = make_body()
    with body:
        pass
    for use in (body.read, lambda: body.drive(Twist()), lambda: body.clock.sleep_until(1.0)):
        with pytest.raises(NotOpenError):
            use()


def test_close_is_idempotent(make_body):
    body = make_body()
    body.close()
    body.open()
    body.close()
    body.close()


def test_readings_lost_to_a_full_queue_are_counted(make_body):
    events = [Event(0.001 * k, "imu", Imu(0.001 * k, 0.0)) for k in range(5000)]
    with make_body(events) as body:
        while body.clock.sleep_until(10.0):
            pass
        assert body.health().dropped == 5000 - 4096
        assert body.read().imu[-1].stamp == pytest.approx(4.999)


def test_a_subscriber_gets_every_reading(make_body):
    body = make_body()
    subscription = body.queues["scans"].subscribe()
    read_all(body)
    assert len(subscription.take()) == 30


def test_it_is_recorded_and_registered(make_body):
    assert isinstance(make_body(), Recorded)
    assert backend_class("replay") is Replay


def test_a_specification_replaces_the_recordings_own(tmp_path):
    log, spec = tmp_path / "x.log", tmp_path / "robot.toml"
    log.write_text("FLASER 3 1 2 3 0 0 0 0 0 0 1.0 host 1.0\n")
    spec.write_text("[lidar]\nbeams = 3\ntime_increment = 0.0\n[lidar.T_base_laser]\nxyz = [0.3, 0, 0]\n")
    with Replay(log, spec).build() as body:
        body.clock.sleep_until(2.0)
        assert body.read().scans[0].T_base_laser.t.tolist() == [0.3, 0.0, 0.0]


def test_a_wrong_specification_is_one_line(tmp_path):
    with pytest.raises((SpecError, RecordingError), match="cannot be read"):
        Replay(tmp_path / "x.log", tmp_path / "none.toml").build()


def test_building_opens_nothing_that_must_be_closed(shared_data):
    body = Replay(shared_data / "urg04lx" / "exp1.dat").build()
    assert body.spec.name == "coreslam"
    assert body.span[0] == body.clock.now()


def test_opening_an_open_recording_leaves_it_where_it_is(make_body):
    with make_body([odometry(0.0), odometry(1.0)]) as body:
        body.clock.sleep_until(1.0)
        body.open()
        assert body.clock.sleep_until(9.0)
        assert stamps(body.read().odometry) == [0.0, 1.0]


def test_commands_that_nobody_takes_are_no_loss(make_body):
    with make_body([Event(0.001 * k, "commands", Command(0.001 * k, Twist())) for k in range(5000)]) as body:
        while body.clock.sleep_until(10.0):
            pass
        assert body.health().dropped == 0
