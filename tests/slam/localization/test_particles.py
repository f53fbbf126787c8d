import math

import numpy as np
import pytest

from slam.localization.clusters import clusters_of
from slam.localization.particles import Particles
from slam.se2 import SE2


def test_the_mean_heading_of_two_sides_of_half_a_turn_lies_between_them():
    particles = Particles.equal(np.array([[0.0, 0.0, math.pi - 0.1], [1.0, 2.0, -math.pi + 0.1]]))
    mean = particles.mean()
    assert (mean.x, mean.y) == (0.5, 1.0)
    assert abs(abs(mean.yaw) - math.pi) < 1e-12


def test_weights_of_any_size_sum_to_one():
    particles = Particles(np.zeros((3, 3)), np.array([-4000.0, -4000.0, -4000.0 + math.log(2.0)]))
    np.testing.assert_allclose(particles.weights, [0.25, 0.25, 0.5])
    assert particles.effective == pytest.approx(1.0 / 0.375)


def test_particles_about_a_pose_have_its_covariance():
    C = np.array([[0.04, 0.01, 0.0], [0.01, 0.09, -0.005], [0.0, -0.005, 0.01]])
    particles = Particles.about(SE2(1.0, 2.0, 0.5), C, 40_000, np.random.default_rng(1))
    np.testing.assert_allclose(particles.covariance(SE2(1.0, 2.0, 0.5)), C, atol=0.002)


def test_particles_anywhere_lie_in_all_of_the_free_space_and_nowhere_else(room_map):
    poses = Particles.anywhere(room_map, 20_000, np.random.default_rng(1)).poses
    cells = room_map.grid.geometry.to_cells(poses[:, :2])
    hit = np.zeros(room_map.grid.log_odds.shape, bool)
    hit[cells[:, 0], cells[:, 1]] = True
    free = room_map.grid.log_odds < 0.0
    assert not (hit & ~free).any()
    assert hit[free].mean() > 0.95
    assert np.histogram(poses[:, 2], 8, (-math.pi, math.pi))[0].min() > 2200


def test_two_places_are_two_modes_the_heavier_first():
    rng = np.random.default_rng(2)
    a, b = rng.normal([1.0, 1.0, 0.0], 0.02, (300, 3)), rng.normal([4.0, -2.0, math.pi], 0.02, (300, 3))
    particles = Particles(np.concatenate([a, b]), np.repeat([0.0, math.log(3.0)], 300))
    heavy, light = clusters_of(particles)
    assert heavy.weight == pytest.approx(0.75)
    assert light.weight == pytest.approx(0.25)
    assert math.hypot(heavy.T_map_base.x - 4.0, heavy.T_map_base.y + 2.0) < 0.01
    assert abs(abs(heavy.T_map_base.yaw) - math.pi) < 0.01
    np.testing.assert_allclose(np.sqrt(np.diag(light.covariance)), 0.02, rtol=0.15)


def test_one_cloud_across_the_borders_of_bins_is_one_mode():
    poses = np.random.default_rng(3).normal([0.5, 0.0, math.pi], [0.2, 0.2, 0.1], (500, 3))
    modes = clusters_of(Particles.equal(poses))
    assert len(modes) == 1
    assert modes[0].weight == pytest.approx(1.0)


def test_stray_particles_are_no_modes():
    rng = np.random.default_rng(4)
    poses = np.concatenate([rng.normal(0.2, 0.02, (990, 3)), rng.uniform(10.0, 60.0, (10, 3))])
    assert len(clusters_of(Particles.equal(poses))) == 1
