"""CARMEN logs: the rules on tiny ones, the counts on a real one."""

import logging
import math
from itertools import pairwise

import numpy as np
import pytest

from hardware.errors import RecordingError
from hardware.logs.registry import open_log


def odom(t, x=0.0, y=0.0, theta=0.0):
    return f"ODOM {x} {y} {theta} 0.1 0.2 0 {t} host {t}"


def flaser(t, ranges=(1.0, 2.0, 3.0, 4.0), x=0.0):
    return f"FLASER {len(ranges)} {' '.join(map(str, ranges))} 9 9 9 {x} 0 0 {t} host {t}"


@pytest.fixture
def read(tmp_path):
    def read_lines(*lines, end="\n"):
        file = tmp_path / "x.log"
        file.write_text("\n".join(lines) + end)
        return open_log(file)

    return read_lines


def channel(log, name):
    return [event.message for event in log.events() if event.channel == name]


def test_odometry_and_scans_come_in_file_order(read):
    log = read("# a comment", odom(1.0, x=0.5), flaser(1.5, x=0.75), odom(2.0, x=1.0))
    assert [(event.channel, event.arrival) for event in log.events()] == [
        ("odometry", 1.0),
        ("odometry", 1.5),
        ("scans", 1.5),
        ("odometry", 2.0),
    ]
    assert [reading.T_odom_base.x for reading in channel(log, "odometry")] == [0.5, 0.75, 1.0]
    assert log.span == (1.0, 2.0)


def test_a_scan_older_than_the_odometry_does_not_turn_it_back(read):
    log = read(odom(1.0), flaser(0.9, x=5.0))
    assert [reading.T_odom_base.x for reading in channel(log, "odometry")] == [0.0]
    assert channel(log, "scans")[0].stamp == 0.9


def test_beams_spread_over_180_degrees_from_the_right(read):
    lidar = read(flaser(0.0)).spec.lidar
    assert np.allclose(np.degrees(lidar.angles), [-90, -45, 0, 45])


def test_parameters_place_the_laser_and_set_its_limit(read):
    log = read(
        "PARAM robot_frontlaser_offset 0.25", "PARAM laser_front_laser_resolution 0.5", "PARAM robot_front_laser_max 3.5", flaser(0.0)
    )
    lidar = log.spec.lidar
    assert (lidar.T_base_laser.t[0], lidar.angle_increment, lidar.range_max) == (0.25, math.radians(0.5), 3.5)
    assert channel(log, "scans")[0].ranges.tolist() == [1.0, 2.0, 3.0, math.inf]


def test_readings_at_the_limit_are_nothing_seen_and_zero_is_invalid(read):
    ranges = channel(read(flaser(0.0, (81.83, 81.8, 81.79, 0.0))), "scans")[0].ranges
    assert np.array_equal(ranges, [np.inf, np.inf, 81.79, np.nan], equal_nan=True)


def test_stamps_that_run_back_a_little_are_clamped_with_one_counted_warning(read, caplog):
    log = read(flaser(0.0), odom(5.0), odom(4.5), odom(4.8), odom(5.1))
    assert [reading.stamp for reading in channel(log, "odometry")] == [0.0, 5.0, 5.0, 5.0, 5.1]
    assert [record.getMessage().split(": ")[1] for record in caplog.records] == [
        "2 stamps ran back, by up to 0.500 s; clamped to the ones before"
    ]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ((flaser(0.0), odom(5.0), odom(3.0)), r"line 3: stamp 3\.0 of odometry runs back by 2\.000 s"),
        ((odom(1.0), "ODOM 1 2 x 0 0 0 1 host 1"), "line 2: could not convert string to float"),
        ((odom(1.0), "ODOM 1 2 3"), "line 2: ODOM has 4 fields, 10 expected"),
        ((flaser(0.0), "FLASER 5 1 2 3"), "line 2: FLASER of 5 beams has 5 fields, 16 expected"),
        ((flaser(0.0), "FLASER"), "line 2: FLASER of 0 beams"),
        ((flaser(0.0), flaser(1.0, (1, 2))), "line 2: a scan of 2 beams among scans of 4"),
        ((flaser(0.0), odom(1.0, x="nan")), r"line 2: pose \(nan, 0\.0, 0\.0\) is not finite"),
        ((flaser(0.0), odom("inf")), "line 2: stamp inf of odometry is not finite"),
        ((flaser(0.0), "PARAM laser_front_laser_resolution nan"), "line 2: .* must be finite"),
        ((odom(0.0), "\x01\x02 binary"), "line 2: .* is no CARMEN record"),
        ((odom(0.0), odom(1.0)), "no FLASER records; found: 2 ODOM"),
    ],
)
def test_a_broken_log_says_where_and_what(read, lines, message):
    with pytest.raises(RecordingError, match=message) as error:
        read(*lines)
    assert "\n" not in str(error.value)


def test_a_last_line_that_is_cut_is_dropped_with_a_warning(read, caplog):
    log = read(flaser(0.0), odom(1.0), "ODOM 1.0 2.", end="")
    assert len(channel(log, "odometry")) == 2
    assert "line 3, the last, is cut and was dropped" in caplog.text


def test_other_records_are_passed_over(read):
    assert len(list(read("SYNC start", flaser(0.0), "TRUEPOS 1 2 3 4 5 6 7 host 8").events())) == 2


def robotlaser(t, ranges=(1.0, 2.0, 3.0, 4.0), x=0.0, max_range=3.5, remissions="2 7 7"):
    beams = f"{len(ranges)} {' '.join(map(str, ranges))} {remissions}"
    return f"ROBOTLASER1 4 -0.5 1.5 0.25 {max_range} 0.01 0 {beams} 9 9 9 {x} 0 0 0.3 0.4 0 0 0 {t} host {t}"


@pytest.mark.parametrize("remissions", ["0", "2 7 7"])
def test_robotlaser_records_alone_tell_the_whole_laser_and_the_odometry(read, remissions):
    log = read(robotlaser(0.0, remissions=remissions), robotlaser(2.0, x=1.0, remissions=remissions))
    scan = channel(log, "scans")[0]
    assert np.allclose(scan.angles, [-0.5, -0.25, 0.0, 0.25])
    assert (scan.ranges.tolist(), scan.range_max) == ([1.0, 2.0, 3.0, math.inf], 3.5)
    assert [(o.T_odom_base.x, o.twist.v) for o in channel(log, "odometry")] == [(0.0, 0.0), (1.0, 0.5)]


def test_robotlaser_records_beside_odom_and_flaser(read):
    log = read(odom(0.0), robotlaser(1.0), flaser(1.0), odom(2.0))
    assert [event.channel for event in log.events()] == ["odometry", "odometry", "scans", "odometry"]
    assert channel(log, "odometry")[1].twist.v == 0.3


def test_a_sick_that_names_81_9_still_has_its_limit_at_81_8(read):
    assert read(robotlaser(0.0, max_range=81.9)).spec.lidar.range_max == 81.8


def test_a_robotlaser_without_a_fan_is_refused(read):
    with pytest.raises(RecordingError, match=r"line 1: .* is no fan"):
        read(robotlaser(0.0).replace("-0.5 1.5 0.25", "nan 0 0"))


@pytest.mark.parametrize("line", ["PARAM", "PARAM robot_name", "PARAM robot_name bob", "Laser-2.raw_x 1", odom(1.0)[:-4], flaser(1.0)[:-4]])
def test_an_odd_line_does_not_refuse_the_log(read, caplog, line):
    read(flaser(0.0), line, odom(2.0))
    assert not caplog.records


@pytest.mark.parametrize("value", ["", "on"])
def test_a_needed_parameter_that_is_no_number_is_ignored_with_a_warning(read, caplog, value):
    assert read(f"PARAM robot_frontlaser_offset {value}", flaser(0.0)).spec.lidar.T_base_laser.t[0] == 0.0
    assert f"PARAM robot_frontlaser_offset is '{value}', no number; ignored" in caplog.text


@pytest.mark.parametrize(
    ("beams", "parameters", "first", "step", "warned"),
    [
        (180, {}, -90, 1, False),
        (180, {"resolution": 1.0}, -90, 1, False),
        (181, {"resolution": 1.0}, -90, 1, False),
        (360, {}, -90, 0.5, False),
        (360, {"resolution": 1.0}, -90, 0.5, True),
        (360, {"resolution": 1.0, "fov": 360}, -180, 1, False),
        (361, {"resolution": 0.5}, -90, 0.5, False),
        (401, {}, -50, 0.25, False),
        (541, {"resolution": 0.5}, -135, 0.5, False),
        (1081, {"resolution": 1.0}, -135, 0.25, True),
    ],
)
def test_the_number_of_beams_tells_their_fan(read, caplog, beams, parameters, first, step, warned):
    lines = [f"PARAM laser_front_laser_{name} {value}" for name, value in parameters.items()]
    lidar = read(*lines, flaser(0.0, [1.0] * beams)).spec.lidar
    assert np.allclose(np.degrees([lidar.angle_min, lidar.angle_increment]), [first, step])
    assert [f"{-2 * first} deg assumed" in r.getMessage() and "--spec" in r.getMessage() for r in caplog.records] == [True] * warned


@pytest.mark.parametrize(("largest", "limited"), [([50.0] * 4, True), ([50.0] * 2, False), ([50.0] * 4 + [51.0], False)])
def test_a_largest_reading_that_repeats_is_nothing_seen(read, largest, limited):
    log = read(flaser(0.0, [1.0 + 0.01 * i for i in range(200 - len(largest))] + largest))
    scan = channel(log, "scans")[0]
    assert np.isinf(scan.ranges).sum() == (4 if limited else 0)
    assert log.spec.lidar.range_max == scan.range_max == (np.nextafter(50.0, 0.0) if limited else 81.8)


def test_scans_alone_tell_the_speed_by_their_poses(read):
    log = read(flaser(0.0), flaser(0.5, x=0.25), flaser(1.0, x=0.25))
    assert [reading.twist.v for reading in channel(log, "odometry")] == [0.0, 0.5, 0.0]


def test_the_intel_lab_log_has_its_counts(shared_data, caplog):
    with caplog.at_level(logging.WARNING):
        log = open_log(shared_data / "intel-lab" / "intel.log")
    odometry, scans = channel(log, "odometry"), channel(log, "scans")
    assert (len(odometry), len(scans)) == (13631 + 910, 910)
    assert not caplog.records
    assert all(later.stamp > earlier.stamp for earlier, later in pairwise(odometry))
    assert {len(scan.ranges) for scan in scans} == {180}
    assert sum(int(np.isinf(scan.ranges).sum()) for scan in scans) == 4172
