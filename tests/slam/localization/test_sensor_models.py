import math

import numpy as np
import pytest

from slam.localization.beam_model import BINS, BeamModel
from slam.localization.sensor_models import LikelihoodField, surface_distances
from slam.scans import PointScan
from slam.se2 import SE2

TRUTH = SE2(-0.6, -0.3, 0.7)
ANGLES = np.linspace(-2.0, 2.0, 120)


def cloud_at(room, T_map_base):
    points = room.points(T_map_base, angles=ANGLES)
    return PointScan(0.0, points, np.zeros_like(points))


def log_at(likelihood, cloud, *poses):
    return likelihood.log(np.array([pose.as_array() for pose in poses]), cloud, np.ones(len(cloud.points)))


def one_point(x, y):
    return PointScan(0.0, np.array([[x, y]]), np.zeros((1, 2)))


@pytest.mark.parametrize("away", [0.0, 0.03, 0.11, 0.3, 0.9])
def test_the_field_is_the_mixture_of_table_6_3_of_the_distance_to_the_wall(room_map, away):
    model = LikelihoodField(0.1, 0.8, 0.2, 2.0)
    peak = 0.8 / (0.1 * math.sqrt(math.tau)) + 0.2 / 5.6
    expected = math.log((0.8 * math.exp(-0.5 * (away / 0.1) ** 2) / (0.1 * math.sqrt(math.tau)) + 0.2 / 5.6) / peak)
    seen = log_at(model.over(room_map, 5.6), one_point(-1.97 + away, 0.1), SE2())[0]
    assert seen == pytest.approx(expected, abs=0.12 * max(1.0, 10.0 * away))


def test_without_random_ranges_the_field_is_a_gaussian(room_map):
    likelihood = LikelihoodField(0.2, 1.0, 0.0, 2.0).over(room_map, 5.6)
    for away in (0.1, 0.3, 0.9):
        assert log_at(likelihood, one_point(-1.97 + away, 0.1), SE2())[0] == pytest.approx(-0.5 * (away / 0.2) ** 2, rel=0.12)


def test_distances_near_a_wall_are_exact_below_the_cell_size(room_map):
    distances = surface_distances(room_map, 2.0)
    height, width = room_map.grid.log_odds.shape
    assert distances.shape == (4 * height + 2, 4 * width + 2)
    cell = room_map.grid.geometry.resolution / 4
    rows, cols = np.mgrid[0 : 4 * height, 0 : 4 * width]
    x, y = room_map.grid.geometry.T_map_grid.transform((np.column_stack([cols.ravel(), rows.ravel()]) + 0.5) * cell).T
    near = (np.abs(x + 1.97) < 0.3) & (np.abs(y) < 0.8)  # about the middle of a wall, on both sides
    found = distances[1:-1, 1:-1].ravel()[near]
    assert np.abs(found - np.abs(x[near] + 1.97)).max() < 0.006


def test_all_outside_the_map_is_far_from_everything(room_map):
    likelihood = LikelihoodField(0.1, 0.9, 0.1, 2.0).over(room_map, 5.6)
    lows = log_at(likelihood, one_point(0.0, 0.0), SE2(100.0, 0.0), SE2(0.0, -300.0), SE2(-50.0, 50.0))
    floor = math.log(0.1 / 5.6 / (0.9 / (0.1 * math.sqrt(math.tau)) + 0.1 / 5.6))
    np.testing.assert_allclose(lows, floor, atol=1e-3)


@pytest.mark.parametrize("model", [LikelihoodField(), LikelihoodField(0.2, 1.0, 0.0), BeamModel()])
def test_the_true_pose_is_likelier_than_those_around_it(room, room_map, model):
    likelihood, cloud = model.over(room_map, 5.6), cloud_at(room, TRUTH)
    steps = [SE2(0.06, 0.0), SE2(-0.06, 0.0), SE2(0.0, 0.06), SE2(0.0, -0.06), SE2(yaw=0.05), SE2(yaw=-0.05)]
    best, *others = log_at(likelihood, cloud, TRUTH, *[TRUTH @ step for step in steps])
    assert best <= 0.0
    assert max(others) < best - 1.0


@pytest.mark.parametrize("model", [LikelihoodField(), BeamModel()])
def test_beams_count_by_their_weights(room, room_map, model):
    likelihood, cloud, poses = model.over(room_map, 5.6), cloud_at(room, TRUTH), np.array([[0.1, 0.2, 0.3]])
    halves = np.arange(len(cloud.points)) % 2 == 0
    parts = [
        likelihood.log(poses, PointScan(0.0, np.ascontiguousarray(cloud.points[h]), np.zeros((h.sum(), 2))), np.full(h.sum(), w))
        for h, w in ((halves, 0.5), (~halves, 0.25))
    ]
    both = likelihood.log(poses, cloud, np.where(halves, 0.5, 0.25))
    np.testing.assert_allclose(both, parts[0] + parts[1], rtol=1e-5)


@pytest.mark.parametrize("model", [LikelihoodField(), BeamModel()])
def test_every_particle_of_many_is_weighed_as_if_alone(room, room_map, model):
    likelihood, cloud = model.over(room_map, 5.6), cloud_at(room, TRUTH)
    poses = np.random.default_rng(3).normal([0.0, 0.0, 0.0], [1.0, 1.0, 2.0], (700, 3))
    ones = np.ones(len(cloud.points))
    alone = np.concatenate([likelihood.log(pose[None], cloud, ones) for pose in poses[::50]])
    np.testing.assert_allclose(likelihood.log(poses, cloud, ones)[::50], alone, rtol=1e-6)


def test_the_beam_model_is_a_density_over_ranges_and_of_the_longest_one():
    model, width = BeamModel(), 5.6 / BINS
    p = model.likelihoods(5.6)
    mass = p[:, :-1].sum(axis=1) * width
    within = slice(60, 400)  # walls well within reach: nothing is cut off
    np.testing.assert_allclose(mass[within], model.z_hit + model.z_short + model.z_rand, atol=0.01)
    assert (p[within, -1] == model.z_max).all()


def test_a_beam_that_ends_too_soon_is_likelier_than_one_that_goes_through_a_wall():
    p = BeamModel().likelihoods(5.6)
    assert p[300, 100] > 1.2 * p[300, 500]


def test_somebody_in_the_way_costs_the_robust_field_little(room, room_map):
    cloud = cloud_at(room, TRUTH)
    blocked = np.arange(len(cloud.points)) % 3 == 0
    points = cloud.points * np.where(blocked, 0.4, 1.0)[:, None]
    person = PointScan(0.0, points, cloud.origins)
    robust, gaussian = LikelihoodField().over(room_map, 5.6), LikelihoodField(0.1, 1.0, 0.0).over(room_map, 5.6)
    losses = [log_at(model, cloud, TRUTH)[0] - log_at(model, person, TRUTH)[0] for model in (robust, gaussian)]
    assert losses[0] < 7.0 * blocked.sum()
    assert losses[1] > 5.0 * losses[0]
