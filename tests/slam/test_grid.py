import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.grid import FREE, LOG_ODDS_LIMIT, OCCUPIED, UNKNOWN, GridGeometry, OccupancyGrid
from slam.se2 import SE2

origins = st.builds(SE2, st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-math.pi, math.pi))
geometries = st.builds(GridGeometry, st.floats(0.01, 1.0), st.integers(1, 40), st.integers(1, 40), origins)


def all_cells(geometry: GridGeometry) -> np.ndarray:
    return np.argwhere(np.ones((geometry.height, geometry.width)))


@given(geometries)
def test_the_centre_of_a_cell_lies_in_that_cell(geometry: GridGeometry) -> None:
    cells = all_cells(geometry)
    np.testing.assert_array_equal(geometry.to_cells(geometry.to_points(cells)), cells)


@given(geometries, st.floats(0.01, 0.99), st.floats(0.01, 0.99))
def test_every_point_of_a_cell_belongs_to_it(geometry: GridGeometry, across: float, up: float) -> None:
    cells = all_cells(geometry)
    inside = geometry.T_map_grid.transform((cells[:, ::-1] + [across, up]) * geometry.resolution)
    np.testing.assert_array_equal(geometry.to_cells(inside), cells)


def test_the_origin_is_the_lower_left_corner_of_the_first_cell() -> None:
    geometry = GridGeometry(0.5, 4, 3, SE2(10.0, 20.0, math.pi / 2))
    np.testing.assert_allclose(geometry.to_points(np.array([[0, 0]])), [[9.75, 20.25]])


def test_rows_run_along_y_and_columns_along_x() -> None:
    geometry = GridGeometry(1.0, 4, 3)
    np.testing.assert_array_equal(geometry.to_cells(np.array([[3.5, 2.5]])), [[2, 3]])


@pytest.mark.parametrize(
    ("row", "col", "inside"), [(0, 0, True), (2, 3, True), (3, 0, False), (0, 4, False), (-1, 0, False), (0, -1, False)]
)
def test_a_grid_contains_its_cells_and_no_others(row: int, col: int, inside: bool) -> None:
    assert GridGeometry(1.0, 4, 3).contains(np.array([[row, col]]))[0] == inside


@pytest.mark.parametrize(
    ("probability", "state"),
    [(0.66, OCCUPIED), (0.64, UNKNOWN), (0.5, UNKNOWN), (0.2, UNKNOWN), (0.19, FREE), (0.01, FREE), (0.99, OCCUPIED)],
)
def test_map_servers_thresholds_decide_the_state(probability: float, state: int) -> None:
    grid = OccupancyGrid.empty(GridGeometry(0.05, 1, 1))
    grid.log_odds[:] = math.log(probability / (1.0 - probability))
    assert grid.states()[0, 0] == state


def test_an_empty_grid_knows_nothing() -> None:
    assert (OccupancyGrid.empty(GridGeometry(0.05, 3, 2)).states() == UNKNOWN).all()


@given(st.lists(st.sampled_from([OCCUPIED, FREE, UNKNOWN]), min_size=6, max_size=6))
def test_states_survive_the_way_through_log_odds(states: list[int]) -> None:
    picture = np.array(states, np.int8).reshape(2, 3)
    np.testing.assert_array_equal(OccupancyGrid.from_states(GridGeometry(0.05, 3, 2), picture).states(), picture)


def test_log_odds_of_a_known_map_stand_at_their_limit() -> None:
    grid = OccupancyGrid.from_states(GridGeometry(0.05, 2, 1), np.array([[OCCUPIED, FREE]], np.int8))
    np.testing.assert_array_equal(grid.log_odds, [[LOG_ODDS_LIMIT, -LOG_ODDS_LIMIT]])


def test_a_wall_point_is_the_mean_of_its_hits_not_the_centre() -> None:
    grid = OccupancyGrid.from_states(GridGeometry(1.0, 2, 2, SE2(5.0, 0.0, math.pi / 2)), np.array([[0, 100], [0, 0]], np.int8))
    grid.hit_offset[0, 1] = 0.25, -0.125  # grid point (1.75, 0.375), turned left by 90 degrees and shifted by 5
    np.testing.assert_allclose(grid.wall_points(), [[4.625, 1.75]])


def test_a_frozen_copy_does_not_follow_and_cannot_be_written() -> None:
    grid = OccupancyGrid.empty(GridGeometry(0.05, 3, 2))
    copy = grid.frozen_copy()
    grid.log_odds[:] = 1.0
    assert not copy.log_odds.any()
    with pytest.raises(ValueError, match="read-only"):
        copy.log_odds[0, 0] = 1.0
