import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import sim.envs  # noqa: F401 (registers)
from sim.envs.driving import drive_home, known_grid
from sim.envs.explore import ExploreEnv
from sim.envs.map_kernel import CELL, HALF, SIDE
from worlds.splits import MapName

ID = "bricktwin/ExploreFrontier-v0"
EASY = MapName("test", "easy", 3).text


@pytest.fixture
def env():
    made = gymnasium.make(ID, world=EASY)
    yield made
    made.close()


def test_gymnasium_finds_nothing_wrong(env):
    check_env(env.unwrapped)


def test_the_nearest_frontier_over_and_over_sees_the_whole_flat(env):
    env.reset(seed=0)
    done = cut = False
    while not (done or cut):
        *_, done, cut, info = env.step(np.int64(0))
    assert done
    assert info["coverage"] >= 0.98
    assert info["collisions"] == 0


def test_the_mask_says_what_can_be_chosen(env):
    observation, info = env.reset(seed=0)
    count = int(observation["action_mask"].sum())
    assert count > 0
    rows = observation["frontiers"].reshape(16, 5)
    assert (rows[:count, 3] > 0.0).all()
    assert not rows[count:].any()
    np.testing.assert_array_equal(info["action_mask"], observation["action_mask"])


def test_a_choice_that_there_is_not_costs_a_second(env):
    observation, _ = env.reset(seed=0)
    count = int(observation["action_mask"].sum())
    if count < 16:
        info = env.step(np.int64(count))[4]
        assert info["time"] == pytest.approx(1.0)
        assert info["path_length"] == 0.0


def test_the_known_part_of_a_map_lies_where_it_was():
    cells = np.zeros((SIDE, SIDE), np.uint8)
    cells[HALF : HALF + 3, HALF : HALF + 6], cells[HALF, HALF] = 1, 15
    grid = known_grid(cells)
    occupied = np.argwhere(grid.occupied())
    np.testing.assert_allclose(grid.geometry.to_points(occupied), [[0.5 * CELL, 0.5 * CELL]])
    assert (grid.log_odds < 0.0).sum() == 17


def test_a_map_that_knows_nothing_has_no_frontier():
    grid = known_grid(np.zeros((SIDE, SIDE), np.uint8))
    assert not grid.log_odds.any()
    np.testing.assert_allclose(grid.geometry.to_points(np.array([[0, 0]])), [[-3.5 * CELL, -3.5 * CELL]])


@pytest.mark.parametrize("pose", ["odometry", "slam"])
def test_there_are_frontiers_from_the_start_however_the_map_is_made(pose):
    env = gymnasium.make(ID, world=EASY, pose=pose, realism="datasheet")
    observation, info = env.reset(seed=0)
    assert observation["action_mask"].any()
    assert info["coverage"] > 0.02
    for _ in range(4):
        info = env.step(np.int64(0))[4]
    assert info["path_length"] > 0.1
    env.close()


def test_a_robot_finds_home():
    env = ExploreEnv(world=EASY)
    env.reset(seed=0)
    for _ in range(60):
        env.step(np.array([0.5, 0.1], np.float32))
    assert np.hypot(*env.body.sight.pose[0, :2]) > 0.4
    assert drive_home(env)
    assert np.hypot(*env.body.sight.pose[0, :2]) < 0.25
    assert abs(env.body.sight.pose[0, 2]) < 0.4
