import numpy as np
import pytest

from hardware.registry import backend_class
from sim.errors import TruthError
from sim.ground_truth import ground_truth
from sim.robot import Sim
from slam.messages import Twist
from worlds.parts import Box


@pytest.fixture
def truth(room_file):
    with Sim(world=room_file(boxes=(Box((1.0, 0.5), (0.4, 0.4, 0.3)), Box((-1.0, 0.5), (0.4, 0.4, 0.03), z=0.5)))).build() as robot:
        robot.drive(Twist(0.2, 0.0))
        robot.clock.sleep_until(0.45)
    return ground_truth(robot)


def test_the_pose_starts_where_the_world_says(truth):
    assert truth.pose(0.0).as_array() == pytest.approx([0.0, 0.0, 0.0], abs=5e-4)


def test_the_truth_outlives_the_robot_and_knows_all_of_the_past(truth):
    stamps = np.linspace(0.0, 0.45, 50)
    trajectory = truth.trajectory(stamps)
    assert np.array_equal(trajectory.stamps, stamps)
    assert np.all(np.diff(trajectory.poses[10:, 0]) > 0.0)
    assert trajectory.poses[30] == pytest.approx(truth.pose(stamps[30]).as_array())


@pytest.mark.parametrize("t", [-0.1, 0.5, float("nan")])
def test_the_truth_knows_no_future(truth, t):
    with pytest.raises(TruthError, match="true pose at"):
        truth.pose(t)


def test_segments_are_what_the_lidar_can_see(truth):
    assert truth.segments().shape == (4 * 4 + 4, 4)


def test_the_grid_is_free_inside_occupied_on_surfaces_and_unknown_behind(truth):
    grid = truth.grid(0.05)
    states, to_cells = grid.states(), grid.geometry.to_cells

    def state(x, y):
        row, col = to_cells(np.array([[x, y]]))[0]
        return states[row, col]

    assert state(0.0, 0.0) == 0
    assert state(1.96, 0.0) == 0
    assert state(2.01, 0.0) == 100
    assert state(1.0, 0.5) == -1
    assert state(0.81, 0.5) == 100
    assert state(-1.0, 0.5) == 0
    assert states[0, 0] == -1


def test_every_surface_cell_touches_a_true_segment(truth):
    grid = truth.grid(0.05)
    points, segments = grid.wall_points(), truth.segments()
    a, b = segments[:, :2], segments[:, 2:]
    along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    offset = points[:, None] - a
    place = np.clip(np.sum(offset * along, axis=2), 0.0, np.linalg.norm(b - a, axis=1))
    distance = np.linalg.norm(offset - place[:, :, None] * along, axis=2).min(axis=1)
    assert distance.max() < 0.05 * 0.72


def test_only_a_twin_has_a_truth(recording_robot):
    with pytest.raises(TruthError, match="ReplayRobot has no ground truth"):
        ground_truth(recording_robot)


def test_a_twin_that_was_never_open_has_no_truth_yet():
    with pytest.raises(TruthError, match="never open"):
        ground_truth(Sim().build())


@pytest.fixture
def recording_robot(tmp_path):
    path = tmp_path / "log.dat"
    path.write_text("PARAM robot_front_laser_max 81.8 0 x 0\nODOM 0 0 0 0 0 0 1.0 x 1.0\nFLASER 2 1 1 0 0 0 0 0 0 1.0 x 1.0\n")
    path = path.rename(tmp_path / "tiny.log")
    return backend_class("replay")(path=path).build()
