import numpy as np
import pytest

from slam.evaluation.coverage import coverage, reachable_area
from slam.grid import FREE, OCCUPIED, GridGeometry, OccupancyGrid
from slam.se2 import SE2


def two_rooms(door: int) -> OccupancyGrid:
    """Two rooms of 2 x 2 m with a door of so many cells between."""
    states = np.full((42, 83), FREE, np.int8)
    states[[0, -1], :], states[:, [0, 41, -1]] = OCCUPIED, OCCUPIED
    states[20 - door // 2 : 20 - door // 2 + door, 41] = FREE
    return OccupancyGrid.from_states(GridGeometry(0.05, 83, 42), states)


def test_a_wide_door_makes_both_rooms_reachable() -> None:
    truth = two_rooms(16)
    assert reachable_area(truth, (1.0, 1.0), 0.2, 5.6).sum() == pytest.approx(np.count_nonzero(truth.states() == FREE), rel=0.01)


def test_through_a_narrow_door_is_only_looked() -> None:
    area = reachable_area(two_rooms(4), (1.0, 1.0), 0.2, 5.6)
    assert area[1:41, 1:41].all()
    assert area[1:41, 42:82].any()
    assert not area[[1, 40], 42].any()  # the corners beside the door


def test_the_true_map_covers_everything_and_a_blank_one_nothing() -> None:
    truth = two_rooms(16)
    area = reachable_area(truth, (1.0, 1.0), 0.2, 5.6)
    assert coverage(truth, truth, area, SE2()) == 1.0
    assert coverage(OccupancyGrid.empty(truth.geometry), truth, area, SE2()) == 0.0


def test_a_map_is_compared_where_it_lies() -> None:
    truth = two_rooms(16)
    area = reachable_area(truth, (1.0, 1.0), 0.2, 5.6)
    T_truth_map = SE2(3.0, -1.0, 0.4)
    inverse = T_truth_map.inverse()
    moved = OccupancyGrid.from_states(GridGeometry(0.05, 83, 42, inverse), truth.states())
    assert coverage(moved, truth, area, T_truth_map) == 1.0


def test_of_no_area_the_share_is_not_a_number() -> None:
    truth = two_rooms(16)
    assert np.isnan(coverage(truth, truth, np.zeros((42, 83), np.bool_), SE2()))
