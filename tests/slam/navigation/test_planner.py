from itertools import pairwise

import numpy as np
import pytest

from slam.navigation.costmap import Costmap, Inflation
from slam.navigation.planner import plan, ways_from


def test_a_way_keeps_its_room_and_leads_to_the_goal(rooms) -> None:
    costmap = Costmap.of(rooms, Inflation())
    path = plan(costmap, (1.0, 1.0), (6.5, 2.4))
    assert path is not None
    assert np.hypot(*(path[0] - (1.0, 1.0))) < 0.04
    assert np.hypot(*(path[-1] - (6.5, 2.4))) < 0.04
    between = np.concatenate([np.linspace(a, b, 50) for a, b in pairwise(path)])
    assert costmap.room_at(between).min() >= costmap.inflation.tight - 0.03


def test_where_there_is_room_a_way_is_straight(of_picture) -> None:
    path = plan(Costmap.of(of_picture("." * 60 + "\n" + ("." * 60 + "\n") * 59, scale=2), Inflation()), (1.0, 1.0), (5.0, 2.7))
    assert path is not None
    assert len(path) == 2


def test_the_way_to_one_goal_is_that_of_all_ways(rooms) -> None:
    costmap = Costmap.of(rooms, Inflation())
    goal = costmap.flat_cell((6.5, 2.4))
    one, all_ways = plan(costmap, (1.0, 1.0), (6.5, 2.4)), ways_from(costmap, (1.0, 1.0))
    assert one is not None
    assert np.hypot(*np.diff(one, axis=0).T).sum() == pytest.approx(np.hypot(*np.diff(all_ways.to(goal), axis=0).T).sum(), rel=0.05)


@pytest.mark.parametrize("goal", [(3.9, 0.4), (20.0, 0.0), (0.25, 1.0)])
def test_there_is_no_way_into_a_wall_or_out_of_the_map(goal, rooms) -> None:
    assert plan(Costmap.of(rooms, Inflation()), (1.0, 1.0), goal) is None


def test_from_outside_the_map_there_is_no_way(rooms) -> None:
    assert plan(Costmap.of(rooms, Inflation()), (-5.0, 1.0), (1.0, 1.0)) is None


def test_a_robot_that_stands_too_near_to_a_wall_finds_a_way_out(rooms) -> None:
    assert plan(Costmap.of(rooms, Inflation()), (0.3, 1.0), (2.0, 1.0)) is not None


def test_what_the_live_scan_sees_is_gone_round(rooms) -> None:
    wall = np.column_stack([np.full(30, 2.0), np.linspace(1.0, 2.2, 30)])
    path = plan(Costmap.of(rooms, Inflation(), obstacles=wall), (0.8, 1.6), (3.2, 1.6))
    assert path is not None
    assert np.abs(path[:, 1] - 1.6).max() > 0.6


def test_through_the_unknown_leads_a_way_only_where_that_is_allowed(of_picture) -> None:
    grid = of_picture("#############\n#...?????...#\n#...?????...#\n#...?????...#\n#############\n", scale=8)
    assert plan(Costmap.of(grid, Inflation()), (1.0, 1.0), (4.4, 1.0)) is None
    assert plan(Costmap.of(grid, Inflation(unknown=2.0)), (1.0, 1.0), (4.4, 1.0)) is not None
