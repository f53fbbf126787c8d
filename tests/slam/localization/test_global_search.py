import math

import numpy as np
import pytest

from slam.errors import ParameterError
from slam.grid import FREE, OCCUPIED, GridGeometry, OccupancyGrid
from slam.kernels.rays import cast
from slam.localization.global_search import GlobalSearch
from slam.localization.known_map import KnownMap
from slam.localization.whole_scan import clear_ends, whole_scan
from slam.messages import LaserScan, Trajectory
from slam.se2 import SE2

REACH = 4.0
BEARINGS = np.radians(np.arange(-120.0, 120.0, 1.0))
STILL = Trajectory(np.empty(0), np.empty((0, 3)))


def walls(twin: bool) -> KnownMap:
    """Two rooms of 3 x 4 m, the second one with a box in its corner unless they are twins; the map is shifted and turned."""
    states = np.full((80, 124), OCCUPIED, np.int8)
    for left in (2, 64):
        states[2:-2, left : left + 58] = FREE
        states[2:14, left : left + 10] = OCCUPIED
    if not twin:
        states[60:78, 100:122] = OCCUPIED
    return KnownMap(OccupancyGrid.from_states(GridGeometry(0.05, 124, 80, SE2(-2.0, 1.0, 0.4)), states))


def seen_from(known_map: KnownMap, T_map_base: SE2, seed: int = 0) -> LaserScan:
    """What a lidar in base sees by the map's own cells, with a centimetre of noise."""
    pose = known_map.grid.geometry.T_map_grid.inverse() @ T_map_base
    rays = np.column_stack([np.full(len(BEARINGS), pose.x), np.full(len(BEARINGS), pose.y), pose.yaw + BEARINGS])
    ranges = cast(known_map.panoramas.walls, rays, 0.05, REACH) + np.random.default_rng(seed).normal(0.0, 0.01, len(BEARINGS))
    return LaserScan(0.0, ranges, BEARINGS, 0.0, 0.05, REACH)


def looked_for(known_map, scan, search=None):
    ends = scan.ranges[:, None] * np.column_stack([np.cos(scan.angles), np.sin(scan.angles)])
    return (search or GlobalSearch()).search(known_map, ends[np.isfinite(scan.ranges)], clear=clear_ends(scan, STILL))


@pytest.fixture(scope="module")
def unlike() -> KnownMap:
    return walls(twin=False)


@pytest.mark.parametrize("local", [SE2(1.5, 1.2, 0.3), SE2(2.0, 3.0, -2.0), SE2(4.2, 1.5, 3.0), SE2(5.5, 1.0, 1.5)])
def test_a_place_with_a_face_of_its_own_is_found_from_nothing(unlike, local):
    pose = unlike.grid.geometry.T_map_grid @ local
    answer = looked_for(unlike, seen_from(unlike, pose))
    off = pose.inverse() @ answer.hypotheses[0].T_map_base
    assert not answer.ambiguous
    assert answer.reason == ""
    assert math.hypot(off.x, off.y) < 0.03
    assert abs(off.yaw) < math.radians(1.0)
    assert answer.hypotheses[0].explained > 0.9


def test_in_one_of_two_rooms_that_look_the_same_both_are_named():
    twins = walls(twin=True)
    pose = twins.grid.geometry.T_map_grid @ SE2(1.5, 2.2, 0.3)
    answer = looked_for(twins, seen_from(twins, pose))
    assert answer.ambiguous
    assert "2 places" in answer.reason
    other = pose.inverse() @ answer.hypotheses[1].T_map_base
    assert min(math.hypot(other.x, other.y), abs(math.hypot(other.x, other.y) - 3.1)) < 0.05


def test_a_scan_of_another_place_altogether_is_not_placed(unlike):
    rng = np.random.default_rng(1)
    ragged = LaserScan(0.0, rng.uniform(0.3, 1.2, len(BEARINGS)), BEARINGS, 0.0, 0.05, REACH)
    answer = looked_for(unlike, ragged)
    assert answer.ambiguous
    assert answer.reason


def test_a_handful_of_points_is_no_scan(unlike):
    answer = GlobalSearch().search(unlike, np.ones((5, 2)))
    assert answer.ambiguous
    assert answer.hypotheses == ()
    assert "too few" in answer.reason


def test_points_that_are_not_finite_change_nothing(unlike):
    pose = unlike.grid.geometry.T_map_grid @ SE2(1.5, 1.2, 0.3)
    scan = seen_from(unlike, pose)
    points = scan.ranges[:, None] * np.column_stack([np.cos(scan.angles), np.sin(scan.angles)])
    spoilt = np.concatenate([points, [[np.nan, 1.0], [np.inf, 0.0]]])
    first, second = GlobalSearch().search(unlike, points), GlobalSearch().search(unlike, spoilt)
    assert [one.T_map_base for one in first.hypotheses] == [one.T_map_base for one in second.hypotheses]


def test_a_pose_is_judged_by_what_the_beams_pass_through(unlike):
    T = unlike.grid.geometry.T_map_grid
    scan = seen_from(unlike, T @ SE2(5.5, 1.0, 1.5))
    points = scan.ranges[:, None] * np.column_stack([np.cos(scan.angles), np.sin(scan.angles)])
    here, elsewhere = (GlobalSearch().judge(unlike, T @ pose, points) for pose in (SE2(5.5, 1.0, 1.5), SE2(2.4, 1.0, 1.5)))
    assert here.explained > 0.95
    assert elsewhere.explained < 0.9
    assert here.score > elsewhere.score + math.log(1000.0)


def test_beams_that_meet_nothing_end_at_the_sensors_range():
    scan = LaserScan(0.0, np.array([1.0, np.inf, np.nan, -np.inf]), np.array([0.0, 0.5 * math.pi, 1.0, 2.0]), 0.0, 0.05, REACH)
    np.testing.assert_allclose(clear_ends(scan, STILL), [[0.0, REACH]], atol=1e-9)


def test_sectors_hold_the_median_of_their_ranges():
    bearings = np.radians(np.arange(-178.0, 180.0, 1.0))
    points = 2.0 * np.column_stack([np.cos(bearings), np.sin(bearings)])
    points[np.abs(bearings) < math.radians(0.5)] *= 0.1
    scan = whole_scan(points, None, None, 100)
    assert scan is not None
    sectors, ranges = scan.sectors(90)
    assert len(sectors) >= 89
    np.testing.assert_allclose(ranges, 2.0, atol=1e-6)


@pytest.mark.parametrize("wrong", [{"candidates": 0}, {"odds": 0.5}, {"map_sigma": -1.0}])
def test_settings_that_mean_nothing_are_refused(wrong):
    with pytest.raises(ParameterError):
        GlobalSearch(**wrong)
