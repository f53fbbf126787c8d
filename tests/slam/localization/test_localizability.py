import dataclasses

import numpy as np
import pytest

from slam.errors import ParameterError
from slam.grid import FREE, OCCUPIED, GridGeometry, OccupancyGrid
from slam.localization.known_map import KnownMap
from slam.localization.localizability import Localizability
from slam.localization.mcl import Mcl
from slam.messages import LaserScan, SensorFrame, Status, WheelOdometry
from slam.se2 import SE2

ANGLES = np.linspace(-2.0, 2.0, 341)
START = SE2(1.5, 1.2, 0.1003)
TWIST = np.array([0.25, 0.0, 0.2])
AVAILABLE = frozenset({"odometry", "scans"})


def room():
    """Walls 0.1 m thick about 5 x 4 m of free space whose lower left corner is the origin."""
    states = np.full((84, 104), FREE)
    states[:2], states[-2:], states[:, :2], states[:, -2:] = (OCCUPIED,) * 4
    return KnownMap(OccupancyGrid.from_states(GridGeometry(0.05, 104, 84, SE2(-0.1, -0.1)), states.astype(np.int8)))


def ranges_at(pose):
    """To the middle of the innermost wall cells, where the map has its hits."""
    headings = pose.yaw + ANGLES
    c, s = np.cos(headings), np.sin(headings)
    across = np.where(c > 0.0, 5.025 - pose.x, -0.025 - pose.x) / c
    return np.minimum(across, np.where(s > 0.0, 4.025 - pose.y, -0.025 - pose.y) / s)


def drive(blocked, seconds=8.0, available=AVAILABLE):
    """Frames of an arc; a share of the beams, in blocks, ends on people who stand half way to the wall and walk on."""
    rng = np.random.default_rng(3)
    for k in range(round(10 * seconds)):
        t = 0.1 * k
        ranges = ranges_at(START @ SE2.exp(TWIST * t)) + rng.normal(0.0, 0.01, len(ANGLES))
        phase = (np.arange(len(ANGLES)) + 2 * k) % 85
        ranges = np.where(phase < 85 * blocked, np.minimum(ranges, 0.6 * ranges.mean()), ranges)
        scan = LaserScan(t, ranges, ANGLES, 0.0, 0.02, 8.0)
        yield SensorFrame(t, (WheelOdometry(t, SE2.exp(TWIST * t)),), (), (scan,), available)


def errors(settings, blocked):
    pipeline = settings.build(room(), START)
    found = []
    for frame in drive(blocked):
        off = (START @ SE2.exp(TWIST * frame.stamp)).inverse() @ pipeline.update(frame).T_map_base
        found.append(off)
    return np.array([np.hypot(off.x, off.y) for off in found])


def test_people_on_two_fifths_of_the_beams_move_it_by_millimetres_and_the_classic_filter_by_far_more():
    mine, classic = errors(Localizability(), 0.4)[20:], errors(Mcl(), 0.4)[20:]
    assert mine.max() < 0.03
    assert classic.max() > 3.0 * mine.max()


def test_equation_14_is_the_documents_own():
    assert errors(Localizability(fusion="eq14"), 0.0)[20:].max() < 0.05


def test_the_same_seed_gives_the_same_bits():
    np.testing.assert_array_equal(errors(Localizability(particles=200), 0.4), errors(Localizability(particles=200), 0.4))


def test_a_start_that_is_half_a_metre_wrong_is_found_out():
    settings = Localizability(start_position=0.5, start_yaw=0.5)
    pipeline = settings.build(room(), START @ SE2(0.4, -0.2, 0.3))
    off = SE2()
    for frame in drive(0.0, 4.0):
        off = (START @ SE2.exp(TWIST * frame.stamp)).inverse() @ pipeline.update(frame).T_map_base
    assert np.hypot(off.x, off.y) < 0.03


def test_a_missing_camera_is_named_once(caplog):
    pipeline = Localizability(particles=100).build(room(), START)
    estimates = [pipeline.update(frame) for frame in drive(0.0, 0.5)]
    assert [record.getMessage()[:9] for record in caplog.records] == ["no camera"]
    assert {estimate.status for estimate in estimates} == {Status.TRACKING}


def test_a_silent_camera_is_named():
    pipeline = Localizability(particles=100).build(room(), START)
    estimate = [pipeline.update(frame) for frame in drive(0.0, 1.5, AVAILABLE | {"images"})][-1]
    assert "silent: camera" in estimate.reason
    assert estimate.status is Status.DEGRADED


def test_no_odometry_is_named():
    pipeline = Localizability(particles=300).build(room(), START)
    frames = (dataclasses.replace(frame, odometry=(), available=frozenset({"scans"})) for frame in drive(0.0, 1.0))
    assert "no wheel odometry" in [pipeline.update(frame) for frame in frames][-1].reason


def test_the_newest_matrix_is_shown_and_knows_a_room_in_both_axes():
    pipeline = Localizability(particles=300).build(room(), START)
    for frame in drive(0.0, 0.5):
        pipeline.update(frame)
    D = pipeline.snapshot().localizability
    assert np.linalg.eigvalsh(D).min() > 100.0


@pytest.mark.parametrize("change", [{"fusion": "best"}, {"tempering": 0.0}, {"effective_min": 1.5}, {"k1": -1.0}])
def test_bad_parameters_are_refused(change):
    with pytest.raises(ParameterError):
        Localizability(**change)
