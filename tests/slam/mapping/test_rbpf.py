"""The particle filter's parts; what every pipeline keeps to is in tests/slam/test_pipelines.py."""

import numpy as np
import pytest

from slam.kernels.patches import SIDE
from slam.mapping.particle_maps import ParticleMaps
from slam.mapping.particle_paths import ParticlePaths
from slam.mapping.rbpf import Rbpf
from slam.se2 import SE2

RING = 2.0 * np.column_stack([np.cos(np.linspace(0.0, 6.2, 300)), np.sin(np.linspace(0.0, 6.2, 300))])
HERE = np.zeros_like(RING)


def drawn(poses, times=6):
    maps = ParticleMaps(len(poses), 0.05, 0.6, -0.3)
    for _ in range(times):
        assert maps.insert(np.array(poses), RING, HERE)
    return maps


def test_walls_are_the_mean_hits_and_what_lies_before_them_is_free():
    grid = drawn([(0.3, -0.2, 0.5)]).grid(0)
    walls = grid.wall_points() - [0.3, -0.2]
    np.testing.assert_allclose(np.linalg.norm(walls, axis=1), 2.0, atol=0.01)
    cell = grid.geometry.to_cells(np.array([[0.8, -0.2]]))[0]
    assert grid.log_odds[cell[0], cell[1]] < -1.0


def test_particles_share_patches_until_one_of_them_writes():
    maps = drawn([(0.0, 0.0, 0.0)] * 8)
    apart = maps.patches
    maps.resample(np.zeros(8, np.int64))
    assert maps.patches == apart // 8
    before = maps.grid(7).log_odds.copy()
    maps.insert(np.array([(0.0, 0.0, 0.0)] * 7 + [(0.2, 0.0, 0.0)]), RING, HERE)
    assert maps.patches > apart // 8
    assert not np.array_equal(maps.grid(7).log_odds, before)
    np.testing.assert_array_equal(maps.grid(0).log_odds, maps.grid(6).log_odds)
    assert not np.array_equal(maps.grid(0).log_odds, maps.grid(7).log_odds)


def test_patches_that_nobody_has_are_used_again():
    maps = drawn([(0.0, 0.0, 0.0)] * 4)
    for _ in range(20):
        maps.resample(np.array([0, 0, 1, 2]))
        maps.insert(np.zeros((4, 3)), RING, HERE)
    assert maps.patches <= 4 * (2 * 2.0 / (SIDE * 0.05) + 2) ** 2
    in_use = np.unique(maps.tables[maps.tables >= 0])
    assert len(in_use) == maps.patches


def test_maps_grow_where_the_robot_goes_and_keep_what_they_had():
    maps = drawn([(0.0, 0.0, 0.0)])
    walls = maps.grid(0).wall_points()
    assert maps.insert(np.array([(-40.0, 25.0, 0.0)]), RING, HERE)
    grown = maps.grid(0).wall_points()
    assert all(np.linalg.norm(grown - wall, axis=1).min() < 1e-5 for wall in walls)


def test_a_map_that_would_be_too_large_is_left_as_it_is():
    maps = drawn([(0.0, 0.0, 0.0)])
    shape = maps.tables.shape
    assert not maps.insert(np.array([(1e6, 0.0, 0.0)]), RING, HERE)
    assert maps.tables.shape == shape


def test_a_path_is_that_of_the_ancestors():
    paths = ParticlePaths(3)
    paths.append(0.0, np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]))
    paths.resample(np.array([2, 2, 0]))
    paths.append(1.0, np.array([[10.0, 0, 0], [11, 0, 0], [12, 0, 0]]))
    paths.resample(np.array([1, 2, 2]))
    assert paths.trajectory(0).poses[:, 0].tolist() == [2.0, 11.0]
    assert paths.trajectory(2).poses[:, 0].tolist() == [0.0, 12.0]


@pytest.mark.parametrize("wrong", [{"particles": 0}, {"sigma": 0.0}, {"distance": -1.0}])
def test_impossible_parameters_are_refused(wrong):
    with pytest.raises(Exception, match=next(iter(wrong))):
        Rbpf(**wrong)


def test_a_start_pose_is_where_all_particles_begin():
    pipeline = Rbpf(particles=3).build(SE2(1.0, 2.0, 0.5))
    assert pipeline.snapshot().map.occupied().sum() == 0


def test_maps_drawn_side_by_side_are_those_drawn_one_by_one():
    poses = [(0.1 * k, -0.05 * k, 0.2 * k) for k in range(9)]
    together = drawn(poses)
    for k, pose in enumerate(poses):
        alone = drawn([pose]).grid(0)
        points, values = alone.wall_points(), together.grid(k).wall_points()
        assert len(points) > 50
        np.testing.assert_allclose(np.sort(values, axis=0), np.sort(points, axis=0), atol=1e-6)
