import numpy as np
import pytest

from slam.errors import UnknownNameError
from slam.grid import GridGeometry, OccupancyGrid
from slam.navigation.costmap import Costmap, Inflation
from slam.navigation.frontiers import Explorer, Frontier, borders
from slam.se2 import SE2

HALF_KNOWN = "###############\n#......???????#\n#......???????#\n#......???????#\n#......???????#\n###############\n"


def test_a_finished_map_has_no_frontier(rooms) -> None:
    assert Explorer().goal(rooms, SE2(1.0, 1.0)) is None


def test_the_frontier_lies_between_the_known_and_the_unknown(of_picture) -> None:
    frontier = Explorer().goal(of_picture(HALF_KNOWN, scale=8), SE2(0.8, 1.2))
    assert frontier is not None
    assert frontier.point[0] == pytest.approx(2.8, abs=0.06)
    assert 1.2 < frontier.viewpoint[0] < 2.8
    assert frontier.gain > 0.5


def test_the_viewpoint_is_a_place_where_the_robot_fits(of_picture) -> None:
    grid = of_picture(HALF_KNOWN, scale=8)
    frontier = Explorer().goal(grid, SE2(0.8, 1.2))
    assert frontier is not None
    assert np.isfinite(Costmap.of(grid, Inflation()).costs_at(np.array([frontier.viewpoint]))[0])


def test_a_frontier_that_cannot_be_reached_is_none(of_picture) -> None:
    shut = of_picture("###########\n#...#..???#\n#...#..???#\n#...#..???#\n###########\n", scale=8)
    assert Explorer().goal(shut, SE2(0.8, 0.8)) is None


def test_a_map_without_free_space_has_no_frontier() -> None:
    assert Explorer().goal(OccupancyGrid.empty(GridGeometry(0.05, 30, 30)), SE2(0.7, 0.7)) is None


def test_a_long_border_is_cut_into_pieces(of_picture) -> None:
    pieces = borders(Costmap.of(of_picture(HALF_KNOWN, scale=20), Inflation()), 0.3)
    assert len(pieces) > 3
    assert max(len(piece) for piece in pieces) <= 32


@pytest.mark.parametrize(("strategy", "best"), [("nearest", 0), ("utility", 1), ("gain", 2)])
def test_the_strategies_weigh_differently(strategy, best) -> None:
    at = (0.0, 0.0)
    frontiers = [Frontier(at, at, 0.4, 1.0, 0.3), Frontier(at, at, 3.0, 3.0, 0.4), Frontier(at, at, 1.0, 4.0, 5.0)]
    assert Explorer(strategy).best(frontiers) is frontiers[best]


def test_an_unknown_strategy_lists_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="available: gain, nearest, utility"):
        Explorer("farthest")


def test_the_holes_of_a_wall_are_no_frontier(of_picture) -> None:
    grid = of_picture("###########\n#.........#\n#.........#\n#.........#\n###########\n???????????\n???????????\n", scale=5)
    grid.log_odds[10:15, 10:40:2] = -3.0  # every other column of the lower wall is missing
    grid.hit_count[10:15, 10:40:2] = 0.0
    assert not borders(Costmap.of(grid, Inflation()), 0.0)
