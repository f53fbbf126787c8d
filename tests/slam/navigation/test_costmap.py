import numpy as np
import pytest

from slam.errors import ParameterError
from slam.grid import FREE, UNKNOWN, GridGeometry, OccupancyGrid
from slam.messages import Trajectory
from slam.navigation.costmap import Costmap, Inflation, states_of
from slam.se2 import SE2


def test_room_is_the_distance_to_the_nearest_wall(rooms) -> None:
    assert Costmap.of(rooms, Inflation()).room_at(np.array([[1.025, 1.6]]))[0] == pytest.approx(0.8, abs=0.051)


def test_costs_grow_towards_a_wall_and_end_where_the_robot_does_not_fit(rooms) -> None:
    costs = Costmap.of(rooms, Inflation()).costs_at(np.array([[1.5, 1.5], [0.55, 1.5], [0.42, 1.5], [0.3, 1.5], [-9.0, 0.0]]))
    assert costs[0] == 1.0
    assert costs[0] < costs[1] < costs[2] < np.inf
    assert np.isinf(costs[3:]).all()


def test_a_turned_map_gives_the_same_costs(rooms) -> None:
    turned = OccupancyGrid.from_states(GridGeometry(0.05, 160, 64, SE2(3.0, -1.0, 0.7)), rooms.states())
    points = np.array([[1.5, 1.5], [0.55, 1.5]])
    there = SE2(3.0, -1.0, 0.7).transform(points)
    np.testing.assert_array_equal(Costmap.of(rooms, Inflation()).costs_at(points), Costmap.of(turned, Inflation()).costs_at(there))


def test_specks_of_unknown_are_noise() -> None:
    states = np.zeros((40, 40), np.int8)
    states[10, 10:12], states[20:25, 20:25] = UNKNOWN, UNKNOWN
    found = states_of(OccupancyGrid.from_states(GridGeometry(0.05, 40, 40), states))
    assert (found[10, 10:12] == FREE).all()
    assert (found[20:25, 20:25] == UNKNOWN).all()


def test_where_the_robot_has_been_nothing_is_unknown() -> None:
    grid = OccupancyGrid.empty(GridGeometry(0.05, 40, 40))
    been = Trajectory(np.array([0.0]), np.array([[1.0, 1.0, 0.0]]))
    assert np.isfinite(Costmap.of(grid, Inflation(), been).costs_at(np.array([[1.0, 1.0]]))[0])
    assert np.isinf(Costmap.of(grid, Inflation()).costs_at(np.array([[1.0, 1.0]]))[0])


def test_a_goal_outside_widens_the_map_where_the_unknown_may_be_crossed() -> None:
    grid = OccupancyGrid.empty(GridGeometry(0.05, 40, 40, SE2(0.0, 0.0, 0.5)))
    costmap = Costmap.of(grid, Inflation(unknown=2.0), goal=(7.0, -3.0))
    assert costmap.flat_cell((7.0, -3.0)) >= 0
    assert Costmap.of(grid, Inflation(), goal=(7.0, -3.0)).flat_cell((7.0, -3.0)) == -1


def test_a_robot_without_size_is_refused() -> None:
    with pytest.raises(ParameterError, match="radius"):
        Inflation(radius=0.0)
