import math
from typing import Any

import numpy as np
import pytest

from slam.errors import ParameterError
from slam.grid import GridGeometry, OccupancyGrid
from slam.matching.branch_and_bound import BranchAndBound
from slam.matching.score_pyramid import ScorePyramid, Scores
from slam.se2 import SE2

TRUTH = SE2(0.2, -0.3, 0.4)
GEOMETRIES = [GridGeometry(0.05, 140, 140, SE2(-3.5, -3.5)), GridGeometry(0.05, 160, 160, SE2(-1.0, -4.2, 0.6))]


@pytest.fixture(scope="module", params=GEOMETRIES, ids=["straight", "turned"])
def pyramid(request: pytest.FixtureRequest, room: Any, make_grid: Any) -> ScorePyramid:
    return ScorePyramid.of(make_grid(room.samples(), request.param))


@pytest.fixture(scope="module")
def corridor(make_walls: Any) -> Any:
    return make_walls([(-6.0, 0.66, 6.0, 0.66), (-6.0, -0.66, 6.0, -0.66)])


def off(found: Any, truth: SE2 = TRUTH) -> SE2:
    assert found is not None
    return truth.inverse() @ found.T_map_base


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (0.6, -0.4, 0.0), (-0.5, 0.5, 0.6), (0.8, 0.7, -0.7)])
def test_a_displaced_pose_is_found_within_a_lattice_step(room: Any, pyramid: ScorePyramid, shift: tuple[float, float, float]) -> None:
    error = off(BranchAndBound().search(pyramid, room.points(TRUTH), TRUTH @ SE2(*shift)))
    assert max(abs(error.x), abs(error.y)) < 0.03
    assert abs(error.yaw) < 0.015


def test_the_whole_map_is_searched_from_anywhere(room: Any, pyramid: ScorePyramid) -> None:
    found = BranchAndBound().search(pyramid, room.points(TRUTH), SE2(1.5, 1.0, -2.5), reach=4.0, turn=math.pi)
    error = off(found)
    assert max(abs(error.x), abs(error.y), abs(error.yaw)) < 0.03


@pytest.mark.parametrize("both_ways", [False, True])
def test_a_scan_is_found_in_another_scan(room: Any, both_ways: bool) -> None:
    rng = np.random.default_rng(0)
    first, second = SE2(0.1, 0.2, 0.3), SE2(-0.4, 0.0, -0.2)
    scans = [room.points(pose, rng.normal(0.0, 0.01, 682)) for pose in (first, second)]
    target, source = ((ScorePyramid.of_scan(points, np.zeros_like(points)), points) for points in scans)
    search = BranchAndBound()
    found = search.search_pair(target, source, SE2()) if both_ways else search.search(target[0], source[1], SE2())
    error = off(found, first.inverse() @ second)
    assert max(abs(error.x), abs(error.y), abs(error.yaw)) < 0.04


def test_a_pair_of_which_one_scan_is_empty_is_not_found(room: Any) -> None:
    points, none = room.points(TRUTH), np.empty((0, 2))
    scan, empty = ((ScorePyramid.of_scan(cloud, np.zeros_like(cloud)), cloud) for cloud in (points, none))
    assert BranchAndBound().search_pair(scan, empty, SE2()) is None


def test_a_perfect_fit_scores_near_one_and_what_is_unknown_none(room: Any, pyramid: ScorePyramid) -> None:
    found = BranchAndBound(0.1, 0.05).search(pyramid, room.points(TRUTH), TRUTH)
    assert found is not None
    assert found.score > 0.85
    assert BranchAndBound(0.1, 0.05).search(pyramid, room.points(TRUTH) + 50.0, TRUTH) is None


def test_points_in_free_space_speak_against_a_pose() -> None:
    grid = OccupancyGrid.from_states(GEOMETRIES[0], np.zeros((140, 140), np.int8))
    assert BranchAndBound(0.2, 0.1).search(ScorePyramid.of(grid), np.ones((20, 2)), SE2()) is None


def test_the_covariance_is_wide_along_a_corridor_and_narrow_across(make_grid: Any, corridor: Any) -> None:
    pyramid = ScorePyramid.of(make_grid(corridor.samples(), GridGeometry(0.05, 260, 60, SE2(-6.5, -1.5))))
    found = BranchAndBound(0.5, 0.2).search(pyramid, corridor.points(SE2(), angles=np.linspace(0.5, 2.6, 400)), SE2())
    assert found is not None
    along, across = math.sqrt(found.covariance[0, 0]), math.sqrt(found.covariance[1, 1])
    assert along > 0.15
    assert across < 0.03


def test_the_covariance_turns_with_the_map(make_grid: Any, corridor: Any) -> None:
    pyramid = ScorePyramid.of(make_grid(corridor.samples(), GridGeometry(0.05, 300, 300, SE2(-7.0, -7.0, 0.3))))
    found = BranchAndBound(0.5, 0.2).search(pyramid, corridor.points(SE2(), angles=np.linspace(0.5, 2.6, 400)), SE2())
    assert found is not None
    assert found.covariance[0, 0] > 20.0 * found.covariance[1, 1]


def test_of_poses_that_fit_alike_the_middle_is_kept(make_grid: Any, corridor: Any) -> None:
    pyramid = ScorePyramid.of(make_grid(corridor.samples(), GridGeometry(0.05, 260, 60, SE2(-6.5, -1.5))))
    points = corridor.points(SE2(), angles=np.linspace(0.9, 2.2, 300))
    found = BranchAndBound(0.5, 0.2).search(pyramid, points, SE2(0.07, 0.0, 0.0))
    assert off(found, SE2()).x == pytest.approx(0.07, abs=0.03)


def test_a_room_that_looks_alike_the_other_way_round_is_ambiguous(make_walls: Any, make_grid: Any) -> None:
    walls = make_walls([(-2.0, -1.0, 2.0, -1.0), (2.0, -1.0, 2.0, 1.0), (2.0, 1.0, -2.0, 1.0), (-2.0, 1.0, -2.0, -1.0)])
    pyramid = ScorePyramid.of(make_grid(walls.samples(), GEOMETRIES[0]))
    points = walls.points(SE2(0.3, 0.2, 0.1))
    one_way = BranchAndBound().search(pyramid, points, SE2(), turn=0.5)
    both_ways = BranchAndBound().search(pyramid, points, SE2(), turn=math.pi)
    assert one_way is not None
    assert both_ways is not None
    assert one_way.ambiguity == 0.0
    assert both_ways.ambiguity > 0.95


def test_a_score_below_what_is_asked_is_no_answer(room: Any, pyramid: ScorePyramid) -> None:
    assert BranchAndBound().search(pyramid, room.points(TRUTH), TRUTH, min_score=0.99) is None


def test_no_points_find_nothing(pyramid: ScorePyramid) -> None:
    assert BranchAndBound().search(pyramid, np.empty((0, 2)), TRUTH) is None
    assert BranchAndBound().search(pyramid, np.full((5, 2), np.nan), TRUTH) is None


def test_an_empty_map_finds_nothing() -> None:
    empty = ScorePyramid.of(OccupancyGrid.empty(GEOMETRIES[1]))
    assert BranchAndBound().search(empty, np.ones((5, 2)), TRUTH) is None


def test_an_empty_scan_has_tables_in_which_nothing_is_found() -> None:
    pyramid = ScorePyramid.of_scan(np.empty((0, 2)), np.empty((0, 2)))
    assert BranchAndBound().search(pyramid, np.ones((5, 2)), TRUTH) is None


def test_without_a_window_only_the_centre_is_tried(room: Any, pyramid: ScorePyramid) -> None:
    found = BranchAndBound().search(pyramid, room.points(TRUTH), TRUTH, reach=0.0, turn=0.0)
    np.testing.assert_allclose(off(found).as_array(), 0.0, atol=1e-9)


@pytest.mark.parametrize("wrong", [{"reach": -1.0}, {"correlated_beams": 0.0}, {"rival": 0.0}, {"penalty": math.nan}])
def test_parameters_that_mean_nothing_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ParameterError):
        BranchAndBound(**wrong)


@pytest.mark.parametrize("wrong", [{"resolution": 0.0}, {"sigma": -0.1}, {"unknown": 1.0}])
def test_scores_that_mean_nothing_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ParameterError):
        Scores(**wrong)
