"""CoreSLAM recordings: the rules on tiny ones, the counts on a real one."""

import math
from itertools import pairwise

import numpy as np
import pytest

from hardware.errors import RecordingError
from hardware.logs.registry import open_log
from slam.se2 import SE2


def row(time_us, left=0, right=0, ranges=None):
    ranges = [1000] * 682 if ranges is None else ranges
    return " ".join(map(str, [time_us, 7, left, right, *[0] * 20, *ranges, 0]))


@pytest.fixture
def read(tmp_path):
    def read_rows(*rows, end="\n"):
        file = tmp_path / "x.dat"
        file.write_text("\n".join(rows) + end)
        return open_log(file)

    return read_rows


def channel(log, name):
    return [event.message for event in log.events() if event.channel == name]


def test_a_turn_of_both_wheels_goes_its_circumference_forward(read):
    log = read(row(0, 10, 20), row(100_000, 2010, 2020))
    pose = channel(log, "odometry")[1].T_odom_base
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((math.tau * 0.077, 0.0, 0.0))


def test_the_first_ticks_are_the_zero_of_the_odometry(read):
    assert channel(read(row(0, 14710, 29221)), "odometry")[0].T_odom_base == SE2()


def test_a_faster_right_wheel_turns_left(read):
    odometry = channel(read(row(0), row(100_000, 0, 100)), "odometry")[1]
    assert odometry.T_odom_base.yaw == pytest.approx(math.tau * 0.077 * 100 / 2000 / 0.330)
    assert odometry.twist.omega == pytest.approx(odometry.T_odom_base.yaw / 0.1)


def test_millimetres_become_metres_and_codes_what_they_mean(read):
    ranges = channel(read(row(0, ranges=[0, 7, 20, 21, 5240, *[4000] * 677])), "scans")[0].ranges
    assert np.array_equal(ranges[:6], [np.inf, np.nan, np.nan, 0.021, 5.24, 4.0], equal_nan=True)


def test_a_sweep_is_older_than_its_row(read):
    scan = channel(read(row(10_000_000)), "scans")[0]
    assert scan.stamp == pytest.approx(10.0 - 0.201 + 44 * 0.1 / 1024)
    assert scan.time_increment == 0.1 / 1024


def test_odometry_arrives_before_the_sweep_of_its_row(read):
    assert [event.channel for event in read(row(0), row(100_000)).events()] == ["odometry", "scans"] * 2


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ((row(0), "1 2 3"), "line 2: 3 columns, 707 expected"),
        (("1 2 3",), "line 1: 3 columns, 706 expected"),
        ((row(0), row("soon")), "line 2: invalid literal"),
        ((row(0), row(100, ranges=["x"] * 682)), "line 2: invalid literal"),
        ((row(5_000_000), row(3_000_000)), r"line 2: stamp 3\.0 of odometry runs back by 2\.000 s"),
        ((row(0), row("9" * 400)), "line 2"),
        (("# nothing else",), "no rows in it"),
    ],
)
def test_a_broken_recording_says_where_and_what(read, rows, message):
    with pytest.raises(RecordingError, match=message) as error:
        read(*rows)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("cut", [1, 5, 100, 2000])
def test_a_last_row_that_is_cut_is_dropped_with_a_warning(read, cut, caplog):
    log = read(row(0), row(100_000), row(200_000)[:cut], end="")
    assert len(channel(log, "scans")) == 2
    assert "line 3, the last, is cut and was dropped" in caplog.text


def test_an_empty_file_is_said_to_be_empty(tmp_path):
    (tmp_path / "x.dat").touch()
    with pytest.raises(RecordingError, match="the file is empty"):
        open_log(tmp_path / "x.dat")


def test_binary_garbage_is_refused(tmp_path):
    (tmp_path / "x.dat").write_bytes(np.random.default_rng(0).bytes(10_000))
    with pytest.raises(RecordingError, match=r"line \d+: \d+ columns, 706 expected"):
        open_log(tmp_path / "x.dat")


def test_the_real_recording_has_its_counts(shared_data):
    log = open_log(shared_data / "urg04lx" / "exp1.dat")
    scans = channel(log, "scans")
    assert (len(scans), len(channel(log, "odometry"))) == (756, 756)
    assert log.span == (212.387282, 287.007421)
    assert {len(scan.ranges) for scan in scans} == {682}
    assert max(np.nanmax(scan.ranges[np.isfinite(scan.ranges)]) for scan in scans) < log.spec.lidar.range_max


def turns_seen(scans) -> np.ndarray:
    """Turn between neighbouring sweeps [rad] from the shift of their ranges; nan where it is not clear."""
    shifts = np.arange(-40, 41)
    turns = []
    for one, two in pairwise(scans):
        before, after = (np.nan_to_num(scan.ranges, nan=9.0, posinf=9.0)[50:-50] for scan in (one, two))
        costs = [np.minimum(np.abs(after[40:-40] - np.roll(before, -shift)[40:-40]), 0.2).mean() for shift in shifts]
        best = int(np.argmin(costs))
        turns.append(shifts[best] * math.tau / 1024 if costs[best] < 0.05 and 0 < best < 80 else np.nan)
    return np.array(turns)


def test_the_wheels_turn_as_far_as_the_lidar_sees(shared_data):
    log = open_log(shared_data / "urg04lx" / "exp1.dat")
    scans, odometry = channel(log, "scans")[:400], channel(log, "odometry")
    seen = turns_seen(scans)
    headings = np.unwrap([reading.T_odom_base.yaw for reading in odometry])
    told = np.diff(np.interp([scan.stamp for scan in scans], [reading.stamp for reading in odometry], headings))
    clear = np.isfinite(seen) & (np.abs(told) > 0.02)
    assert clear.sum() > 30
    assert np.dot(seen[clear], told[clear]) / np.dot(told[clear], told[clear]) == pytest.approx(1.0, abs=0.15)
