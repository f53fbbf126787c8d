import itertools
import math

import numpy as np
import pytest

ROUNDING = 2e-9
"""Recordings keep whole nanoseconds [s]."""


def gathered(frames, channel):
    return [reading for frame in frames for reading in getattr(frame, channel)]


@pytest.mark.parametrize("channel", ["odometry", "imu", "scans"])
def test_stamps_grow_in_every_channel(run, channel):
    stamps = [reading.stamp for reading in gathered(run.frames, channel)]
    assert len(stamps) > 20
    assert np.all(np.diff(stamps) > 0.0)


@pytest.mark.parametrize("channel", ["odometry", "imu", "scans"])
def test_no_stamp_is_in_the_future(run, channel):
    for frame in run.frames:
        assert all(reading.stamp <= frame.stamp + ROUNDING for reading in getattr(frame, channel))


def test_frames_are_ordered(run):
    assert np.all(np.diff([frame.stamp for frame in run.frames]) >= 0.0)


def test_a_frame_names_the_sensors_of_the_spec(run):
    robot, frames, _ = run
    assert {frame.available for frame in frames} == {robot.spec.available}


def test_scans_are_what_the_spec_says(run):
    robot, frames, _ = run
    lidar = robot.spec.lidar
    for scan in gathered(frames, "scans"):
        assert len(scan.ranges) == lidar.beams
        assert np.array_equal(scan.angles, lidar.angles)
        assert scan.time_increment == pytest.approx(lidar.time_increment, rel=1e-6)
        assert (scan.range_min, scan.range_max) == (lidar.range_min, lidar.range_max)
        assert scan.T_base_laser == lidar.T_base_laser


def test_ranges_are_within_the_limits_or_not_finite(run):
    for scan in gathered(run.frames, "scans"):
        finite = scan.ranges[np.isfinite(scan.ranges)]
        assert finite.size > 300
        assert finite.min() >= scan.range_min
        assert finite.max() <= scan.range_max


def test_sensors_keep_the_rates_of_the_spec(run, live):
    robot, frames, _ = run
    periods = {"odometry": robot.spec.drive.period, "imu": robot.spec.imu.period, "scans": robot.spec.lidar.period}
    for channel, period in periods.items():
        stamps = [reading.stamp for reading in gathered(frames, channel)]
        if live(robot):
            assert np.median(np.diff(stamps)) == pytest.approx(period, rel=0.1)
        else:
            assert np.allclose(np.diff(stamps), period, atol=1e-6)


def test_arrays_cannot_be_written(run):
    scan = gathered(run.frames, "scans")[0]
    for array in (scan.ranges, scan.angles, scan.T_base_laser.R, scan.T_base_laser.t):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


def test_a_scan_comes_when_odometry_covers_its_last_beam(run):
    covered = -math.inf
    for frame in run.frames:
        covered = max([covered, *(reading.stamp for reading in frame.odometry)])
        assert all(scan.end <= covered for scan in frame.scans)


def test_nothing_is_delivered_twice(case, live):
    with case.make() as robot:
        robot.clock.sleep_until(robot.clock.now() + 0.3)
        before = robot.read()
        frame = robot.read()
    for channel in ("odometry", "imu", "scans"):
        stamps = [reading.stamp for reading in getattr(before, channel)]
        assert live(robot) or getattr(frame, channel) == ()
        assert all(reading.stamp > max(stamps, default=-math.inf) for reading in getattr(frame, channel))


def test_forward_is_along_x_in_metres(run):
    odometry = gathered(run.frames, "odometry")
    before_turn = [reading for reading in odometry if reading.stamp <= run.turn][-1]
    told, _ = run.told(before_turn.stamp)
    assert before_turn.T_odom_base.x == pytest.approx(told, abs=0.03)  # less what latency and the start take
    assert before_turn.T_odom_base.y == pytest.approx(0.0, abs=0.01)


def test_odometry_starts_at_its_origin(run):
    first = gathered(run.frames, "odometry")[0]
    assert first.T_odom_base.as_array() == pytest.approx([0.0, 0.0, 0.0], abs=1e-3)


def test_left_is_positive_for_odometry_and_gyro(run):
    last = gathered(run.frames, "odometry")[-1]
    _, told = run.told(last.stamp)
    assert last.T_odom_base.yaw == pytest.approx(told, abs=0.1)
    rates = [reading.yaw_rate for reading in gathered(run.frames, "imu") if reading.stamp > run.turn + 0.5]
    assert np.mean(rates) == pytest.approx(0.5, abs=0.05)


def test_wheel_angles_and_twist_agree_with_the_odometry(run):
    robot, frames, _ = run
    odometry = gathered(frames, "odometry")
    moved = odometry[0].T_odom_base
    for before, after in itertools.pairwise(odometry):
        left, right = (b - a for a, b in zip(before.wheel_angles, after.wheel_angles, strict=True))
        moved = moved @ robot.spec.drive.increment(left, right)
    assert moved.as_array() == pytest.approx(odometry[-1].T_odom_base.as_array(), abs=1e-6)
    steady = [reading.twist.v for reading in odometry if 1.0 < reading.stamp - odometry[0].stamp < 1.9]
    assert np.mean(steady) == pytest.approx(0.1, abs=0.005)
