import math

import numpy as np
import pytest

from slam.evaluation.maps import distance_to_walls, iou, wall_recall, wall_rms
from slam.evaluation.visibility import View, sample_walls, visible_walls
from slam.grid import GridGeometry, OccupancyGrid
from slam.se2 import SE2

ROOM = np.array([(0, 0, 2, 0), (2, 0, 2, 2), (2, 2, 0, 2), (0, 2, 0, 0)], dtype=np.float64)
ALL_ROUND = View(5.6, -math.pi, math.pi)
CENTRE = np.array([[1.0, 1.0, 0.0]])
T_WORLD_MAP = SE2(0.7, -0.4, 0.5)


def mapped(points_in_world, T_world_map=T_WORLD_MAP, resolution=0.05):
    """A grid with one exact hit in each cell that holds points."""
    points = T_world_map.inverse().transform(points_in_world)
    grid = OccupancyGrid.empty(GridGeometry(resolution, 120, 120, SE2(-2.0, -2.0, 0.2)))
    cells = grid.geometry.to_cells(points)
    local = grid.geometry.T_map_grid.inverse().transform(points)
    grid.log_odds[cells[:, 0], cells[:, 1]] = 5.0
    grid.hit_offset[cells[:, 0], cells[:, 1]] = local - (cells[:, ::-1] + 0.5) * resolution
    return grid


def test_a_map_of_the_walls_themselves_is_perfect():
    visible = visible_walls(ROOM, CENTRE, ALL_ROUND)
    grid = mapped(sample_walls(ROOM))
    assert wall_rms(grid, ROOM, T_WORLD_MAP) == pytest.approx(0.0, abs=1e-6)
    assert wall_recall(grid, visible, T_WORLD_MAP) == 1.0
    assert iou(grid, ROOM, visible, T_WORLD_MAP) == 1.0


def test_wall_rms_is_the_offset_of_a_shifted_wall():
    shifted = sample_walls(ROOM[:1]) - np.array([0.0, 0.03])
    assert wall_rms(mapped(shifted), ROOM, T_WORLD_MAP) == pytest.approx(0.03, abs=1e-6)


def test_a_wall_that_is_missing_lowers_recall_and_iou_by_its_share():
    grid = mapped(sample_walls(ROOM[:3]))
    visible = visible_walls(ROOM, CENTRE, ALL_ROUND)
    assert wall_recall(grid, visible, T_WORLD_MAP) == pytest.approx(0.75, abs=0.02)
    assert iou(grid, ROOM, visible, T_WORLD_MAP) == pytest.approx(0.75, abs=0.03)


def test_a_wall_beyond_the_edge_of_the_map_lowers_the_iou():
    far = np.vstack([ROOM, [(9.0, 0.0, 9.0, 2.0)]])
    grid = mapped(sample_walls(ROOM))
    assert iou(grid, far, sample_walls(far), T_WORLD_MAP) == pytest.approx(0.8, abs=0.03)


def test_clutter_lowers_the_iou_and_not_the_recall():
    grid = mapped(np.vstack([sample_walls(ROOM), sample_walls(np.array([(0.5, 0.5, 1.5, 1.5)]))]))
    visible = visible_walls(ROOM, CENTRE, ALL_ROUND)
    assert wall_recall(grid, visible, T_WORLD_MAP) == 1.0
    assert iou(grid, ROOM, visible, T_WORLD_MAP) < 0.9


def test_a_map_that_knows_nothing_has_no_wall_error_and_no_recall():
    grid = OccupancyGrid.empty(GridGeometry(0.05, 4, 4))
    assert math.isnan(wall_rms(grid, ROOM, SE2()))
    assert wall_recall(grid, sample_walls(ROOM), SE2()) == 0.0
    assert iou(grid, ROOM, sample_walls(ROOM), SE2()) == 0.0


def test_walls_behind_walls_are_not_visible():
    screen = np.array([(0.5, 0.9, 1.5, 0.9)])
    visible = visible_walls(np.vstack([ROOM, screen]), np.array([[1.0, 1.0, 0.0]]), ALL_ROUND)
    assert not np.any((np.abs(visible[:, 0] - 1.0) < 0.5) & (visible[:, 1] < 0.5))
    assert np.count_nonzero(visible[:, 1] == 0.9) == 100


def test_a_wall_is_visible_from_any_pose_of_the_path():
    screen = np.array([(0.5, 0.9, 1.5, 0.9)])
    path = np.array([[1.0, 1.0, 0.0], [1.0, 0.8, 0.0]])
    assert len(visible_walls(np.vstack([ROOM, screen]), path, ALL_ROUND)) == 900


def test_walls_out_of_reach_or_behind_the_lidar_are_not_visible():
    assert len(visible_walls(ROOM, CENTRE, View(0.9, -math.pi, math.pi))) == 0
    ahead = visible_walls(ROOM, CENTRE, View(5.6, -math.pi / 2, math.pi / 2))
    assert len(ahead) == 400
    assert ahead[:, 0].min() >= 1.0


def test_samples_are_one_centimetre_apart_and_cover_short_walls():
    samples = sample_walls(np.array([(0.0, 0.0, 0.105, 0.0), (1.0, 1.0, 1.0, 1.001)]))
    assert len(samples) == 12
    assert np.diff(samples[:11, 0]) == pytest.approx(0.105 / 11)


def test_distance_is_to_the_segment_and_not_to_its_line():
    walls = np.array([(0.0, 0.0, 1.0, 0.0), (5.0, 5.0, 5.0, 5.0)])
    assert distance_to_walls(np.array([(2.0, 0.0), (0.5, -0.2), (5.0, 6.0)]), walls).tolist() == pytest.approx([1.0, 0.2, 1.0])
