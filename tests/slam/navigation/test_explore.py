import numpy as np
import pytest

from slam.grid import GridGeometry, OccupancyGrid
from slam.messages import Status
from slam.navigation.explore import Explore
from slam.navigation.frontiers import STRATEGIES, Explorer
from slam.se2 import SE2

NO_ROUTE = np.empty((0, 2))
START = SE2(1.0, 1.0, 0.3)


@pytest.mark.parametrize("strategy", sorted(STRATEGIES))
def test_every_explorer_maps_both_rooms_touches_nothing_and_comes_home(strategy, rooms, cell_world) -> None:
    world, policy = cell_world(rooms, START), Explore(explorer=Explorer(strategy)).build(NO_ROUTE)
    world.run(policy, 200.0)
    assert policy.outcome is not None
    assert policy.outcome.reached
    assert policy.outcome.reason == "all that can be reached is mapped; the robot is back at its start"
    assert world.seen() > 0.99
    assert world.closest > 0.13
    assert np.hypot(world.pose.x - START.x, world.pose.y - START.y) < 0.15


def test_two_explorations_are_the_same(rooms, cell_world) -> None:
    worlds = [cell_world(rooms, START) for _ in range(2)]
    for world in worlds:
        world.run(Explore().build(NO_ROUTE), 60.0)
    assert worlds[0].pose == worlds[1].pose


def test_a_door_that_is_too_narrow_is_not_driven_through(of_picture, cell_world) -> None:
    truth = of_picture("#########\n#...#...#\n#...#...#\n#.......#\n#...#...#\n#########\n", scale=5)  # a door of 25 cm
    world, policy = cell_world(truth, SE2(0.65, 0.65)), Explore().build(NO_ROUTE)
    world.run(policy, 200.0)
    assert policy.outcome is not None
    assert world.pose.x < 1.1
    assert world.closest > 0.13


def test_a_robot_that_is_shut_in_says_so(of_picture, cell_world) -> None:
    world, policy = cell_world(of_picture("###\n#.#\n###\n", scale=4), SE2(0.3, 0.3)), Explore().build(NO_ROUTE)
    world.run(policy, 100.0)
    assert policy.outcome is not None
    assert not policy.outcome.reached
    assert "no free space" in policy.outcome.reason


def test_a_map_that_stays_empty_ends_the_exploration(cell_world, rooms) -> None:
    world, policy = cell_world(rooms, START), Explore().build(NO_ROUTE)
    world.solid = np.ones_like(world.solid)  # a lidar that sees nothing
    world.map = OccupancyGrid.empty(GridGeometry(0.05, 20, 20))
    world.truth = world.map
    world.run(policy, 100.0)
    assert policy.outcome is not None
    assert "no free space" in policy.outcome.reason


def test_a_lost_pose_stops_the_robot_and_is_told(rooms, cell_world, caplog) -> None:
    world, policy = cell_world(rooms, START), Explore().build(NO_ROUTE)
    world.run(policy, 15.0)
    world.status, lost = Status.LOST, world.pose
    world.run(policy, 0.4)
    assert np.hypot(world.pose.x - lost.x, world.pose.y - lost.y) < 0.02
    assert "does not know where it is" in caplog.text
    world.status = Status.TRACKING
    world.run(policy, 200.0)
    assert "knows again where it is" in caplog.text
    assert policy.outcome is not None
    assert policy.outcome.reached


def test_the_limit_sends_it_home(rooms, cell_world) -> None:
    world, policy = cell_world(rooms, START), Explore(limit=14.0).build(NO_ROUTE)
    world.run(policy, 100.0)
    assert policy.outcome is not None
    assert not policy.outcome.reached
    assert policy.outcome.reason.startswith("the limit of 14 s is over")


def test_who_stands_about_the_robot_for_a_moment_does_not_end_the_exploration(rooms, cell_world) -> None:
    world, policy = cell_world(rooms, START), Explore().build(NO_ROUTE)
    world.run(policy, 9.0)
    x, y = world.pose.x, world.pose.y
    for x0, y0, x1, y1 in ((-0.3, -0.3, 0.3, -0.2), (-0.3, 0.2, 0.3, 0.3), (-0.3, -0.3, -0.2, 0.3), (0.2, -0.3, 0.3, 0.3)):
        world.block(x + x0, y + y0, x + x1, y + y1)
    world.run(policy, 3.0)
    assert policy.outcome is None
    world.added[:] = False
    world.run(policy, 200.0)
    assert policy.outcome is not None
    assert policy.outcome.reached
    assert world.seen() > 0.99


def test_a_door_that_is_shut_only_to_who_comes_near_is_given_up(rooms, cell_world) -> None:
    world, policy = cell_world(rooms, START), Explore(changes=1).build(NO_ROUTE)
    world.block(3.8, 0.2, 4.0, 3.1)  # the map looks through it, as through glass
    world.run(policy, 150.0)
    assert policy.outcome is not None
    assert np.hypot(world.pose.x - START.x, world.pose.y - START.y) < 0.15
