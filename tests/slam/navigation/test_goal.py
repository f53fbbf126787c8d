import numpy as np
import pytest

from slam.errors import GoalError
from slam.navigation.goal import GoTo, check_goal
from slam.se2 import SE2

NO_ROUTE = np.empty((0, 2))
START = SE2(1.0, 1.0, 0.3)


@pytest.mark.parametrize("known", [True, False])
def test_it_drives_into_the_other_room(known, rooms, cell_world) -> None:
    world, policy = cell_world(rooms, START, known=known), GoTo(6.5, 2.4).build(NO_ROUTE)
    world.run(policy, 80.0)
    assert policy.outcome is not None
    assert policy.outcome.reached
    assert np.hypot(world.pose.x - 6.5, world.pose.y - 2.4) < 0.12
    assert world.closest > 0.13


def test_it_goes_round_what_no_map_shows(rooms, cell_world) -> None:
    world, policy = cell_world(rooms, SE2(0.6, 1.6), known=True), GoTo(3.2, 1.6).build(NO_ROUTE)
    world.block(1.9, 1.3, 2.0, 2.0)
    world.run(policy, 60.0)
    assert policy.outcome is not None
    assert policy.outcome.reached
    xy = np.array([[1.95, y] for y in np.linspace(1.3, 2.0, 20)])
    path = np.array(world.path)[:, :2]
    assert np.hypot(*(path[:, None] - xy).transpose(2, 0, 1)).min() > 0.13


def test_a_door_that_has_closed_is_told(rooms, cell_world) -> None:
    world, policy = cell_world(rooms, START, known=True), GoTo(6.5, 2.4).build(NO_ROUTE)
    world.block(3.8, 0.9, 4.0, 2.3)
    world.run(policy, 150.0)
    assert policy.outcome is not None
    assert not policy.outcome.reached
    assert "cannot be reached" in policy.outcome.reason


def test_a_goal_that_turns_out_to_lie_in_a_wall_ends_the_drive(rooms, cell_world) -> None:
    world, policy = cell_world(rooms, START), GoTo(3.82, 0.4).build(NO_ROUTE)
    world.run(policy, 60.0)
    assert policy.outcome is not None
    assert policy.outcome.reason == "the goal (3.82, 0.4) lies in a wall"


@pytest.mark.parametrize(
    ("goal", "problem"),
    [((3.9, 0.4), "in a wall"), ((9.0, 0.0), "outside the map"), ((0.3, 1.0), "m of room about it"), ((0.1, 0.1), "in a wall")],
)
def test_a_goal_where_no_robot_can_stand_is_refused(goal, problem, rooms) -> None:
    with pytest.raises(GoalError, match=problem):
        check_goal(rooms, goal)


def test_a_goal_in_the_unknown_of_a_finished_map_is_refused(of_picture) -> None:
    with pytest.raises(GoalError, match="knows nothing"):
        check_goal(of_picture("#####\n#..?#\n#..?#\n#####\n", scale=10), (1.7, 1.0))
