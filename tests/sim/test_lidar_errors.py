"""The documented errors of the lidar, by their statistics."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hardware import chassis
from hardware.spec import LidarSpec
from scripts.bench.realism import RANGES, noise_fit
from sim.lidar import CASTERS, Lidar, static_rays
from sim.lidar_errors import LidarErrors
from sim.lidar_kernel import DARK, GLASS, GLOSSY, MATTE
from sim.motion import Motion
from sim.rays import EmbreeRays
from sim.realism import REALISMS, Realism
from slam.se3 import SE3
from worlds.parts import Wall
from worlds.world import World

SPEC = LidarSpec()
FRONT = slice(330, 351)
"""Beams within 3.6 deg of straight ahead."""
STANDING = Motion(0, SE3())
STANDING.append([(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)] * 100)


def wall(distance, yaw=0.0, material=MATTE, width=20.0):
    """Rays against one upright wall straight ahead of the lidar, turned by `yaw` from facing it."""
    return EmbreeRays(triangles(distance, width, yaw), np.full(2, material, np.int8))


def triangles(distance, width, yaw=0.0):
    x, side = SPEC.T_base_laser.t[0] + distance, 0.5 * width * np.array([math.sin(yaw), math.cos(yaw), 0.0])
    low, high = np.array([x, 0.0, -2.0]), np.array([x, 0.0, 2.0])
    return np.array([[low - side, low + side, high + side], [low - side, high + side, high - side]], np.float32)


def front(rays, errors, scans=100, seed=0, **more):
    """Ranges (scans, 21) of the beams straight ahead, and what they would be without errors."""
    lidar = Lidar(SPEC, Realism(errors), rays, (), np.random.default_rng(seed), **more)
    ideal = Lidar(SPEC, Realism(), rays, (), np.random.default_rng(0))
    measured = np.array([lidar.scan(STANDING, 0.0).ranges[FRONT] for _ in range(scans)])
    return measured, ideal.scan(STANDING, 0.0).ranges[FRONT]


@pytest.mark.parametrize("distance", RANGES)
def test_noise_is_normal_with_the_documented_sigma_at_every_range(distance):
    assert noise_fit(distance, 100) > 1e-3


@pytest.mark.parametrize("angle", [30.0, 60.0, 75.0])
def test_a_slanted_wall_is_noisier_and_seems_nearer(angle):
    errors = LidarErrors(spot=0.01, incidence_sigma=0.5, incidence_bias=0.3)
    measured, true = front(wall(2.0, math.radians(angle), width=8.0), errors, scans=400)
    depth = 0.01 * 2.0 * math.tan(math.radians(angle))
    assert (measured - true)[:, 10].std() == pytest.approx(0.5 * depth, rel=0.1)
    assert (measured - true)[:, 10].mean() == pytest.approx(-0.3 * depth, abs=0.1 * depth)


def test_a_device_has_a_bias_of_its_own_that_swings_with_range():
    errors = LidarErrors(offset_sigma=0.01, cyclic_bias=0.01, cyclic_length=3.2)
    lidars = [Lidar(SPEC, Realism(errors), wall(1.0), (), np.random.default_rng(seed)) for seed in range(300)]
    biases = np.array([lidar.biases(0.0) for lidar in lidars])
    assert biases.mean(axis=1).std() == pytest.approx(0.01, rel=0.2)
    assert np.ptp(biases, axis=1) == pytest.approx(0.02, rel=0.02)
    measured, true = front(wall(1.0), errors, scans=1, seed=7)
    assert (measured[0] - true)[10] == pytest.approx(lidars[7].biases(0.0)[20], abs=0.001)


def test_the_drift_of_warming_up_fades():
    lidar = Lidar(SPEC, Realism(LidarErrors(warm_up=0.02, warm_up_time=600.0)), wall(1.0), (), np.random.default_rng(0))
    assert lidar.biases(0.0) == pytest.approx(0.02)
    assert lidar.biases(600.0) == pytest.approx(0.02 / math.e)


def test_a_spot_on_an_edge_reads_between_the_two_depths():
    near, far = wall(1.0, width=0.5), wall(2.0)
    both = EmbreeRays(np.concatenate([triangles(1.0, 0.5), triangles(2.0, 20.0)]))
    errors = LidarErrors(spot=0.01, edge_depth=0.05)
    lidar = Lidar(SPEC, Realism(errors), both, (), np.random.default_rng(0))
    scans = np.array([lidar.scan(STANDING, 0.0).ranges for _ in range(300)])
    least, most = (Lidar(SPEC, Realism(), rays, (), np.random.default_rng(0)).scan(STANDING, 0.0).ranges for rays in (near, far))
    edge = int(np.flatnonzero(np.isfinite(least))[-1])
    assert np.all(scans[:, edge] >= least[edge] - 0.002)
    assert np.all(scans[:, edge] <= most[edge] + 0.002)
    between = (scans[:, edge] > least[edge] + 0.01) & (scans[:, edge] < most[edge] - 0.01)
    assert np.mean(between) == pytest.approx(0.5 * 0.01 / SPEC.angle_increment, abs=0.1)
    assert np.all(scans[:, edge - 3] == scans[0, edge - 3])


def test_a_share_of_the_spots_on_an_edge_gives_an_error_code():
    both = EmbreeRays(np.concatenate([triangles(1.0, 0.5), triangles(2.0, 20.0)]))
    lidar = Lidar(SPEC, Realism(LidarErrors(spot=0.01, edge_depth=0.05, edge_reject=0.4)), both, (), np.random.default_rng(0))
    codes = np.isnan([lidar.scan(STANDING, 0.0).ranges[200:480] for _ in range(400)])
    edges = np.flatnonzero(codes.any(axis=0))
    assert len(edges) == 4
    assert codes[:, edges].mean() == pytest.approx(0.4 * 0.5 * 0.01 / SPEC.angle_increment, abs=0.04)


def test_a_dark_wall_is_lost_beyond_its_reach():
    errors = REALISMS["datasheet"].lidar
    assert np.isnan(front(wall(3.0, material=DARK), errors)[0]).all()
    assert np.isnan(front(wall(1.5, material=DARK), errors)[0]).mean() < 0.01


def test_a_matte_wall_is_seen_as_far_as_the_data_sheet_says_but_not_at_any_angle():
    errors = REALISMS["datasheet"].lidar
    assert np.isfinite(front(wall(5.0), errors)[0]).mean() > 0.99
    assert np.isnan(front(wall(3.0, math.radians(85.0), width=8.0), errors)[0][:, 10]).mean() > 0.9


def test_a_glossy_wall_dazzles_straight_on_and_is_lost_aslant():
    errors = REALISMS["datasheet"].lidar
    straight = front(wall(2.0, material=GLOSSY), errors)[0]
    assert np.isnan(straight).mean() == pytest.approx(errors.glare_blinds, abs=0.1)
    aslant = front(wall(2.0, math.radians(30.0), GLOSSY, 8.0), errors)[0]
    assert not np.isfinite(aslant).any()
    assert np.isposinf(aslant).mean() == pytest.approx(errors.gloss_silent, abs=0.1)
    assert np.isfinite(front(wall(0.7, math.radians(30.0), GLOSSY, 8.0), errors)[0]).mean() > 0.99


def test_a_pane_lets_most_beams_through_unless_it_is_met_at_a_right_angle():
    errors = replace(REALISMS["datasheet"].lidar, edge_depth=math.inf)
    for yaw, share in ((0.0, errors.pane_seen), (0.5, errors.pane_seen_aslant)):
        pane = EmbreeRays(np.concatenate([triangles(1.0, 8.0, yaw), triangles(3.0, 20.0)]), np.array([GLASS, GLASS, MATTE, MATTE], np.int8))
        measured = front(pane, errors, scans=300, through_glass=wall(3.0))[0][:, 8:13]
        assert np.mean(measured < 2.0) == pytest.approx(share, abs=0.05)
        assert np.mean(measured > 2.5) > 0.9 * (1.0 - share)


def test_an_ideal_lidar_sees_every_material_alike():
    for material in (DARK, GLOSSY, GLASS):
        measured, true = front(wall(3.0, 0.4, material, 8.0), LidarErrors(), scans=1)
        assert np.array_equal(measured[0], true)
        assert np.isfinite(measured).all()


@pytest.mark.parametrize("caster", CASTERS)
def test_materials_of_a_world_reach_the_lidar(caster):
    walls = (Wall((1.0, -2.0), (1.0, 2.0), 0.1, 1.0, material="glass"), Wall((3.0, -9.0), (3.0, 9.0), 0.1, 1.0, material="dark"))
    world = World(name="pane", walls=walls, start=(0.0, 0.0, 0.0))
    errors = LidarErrors(pane_seen=0.0, pane_seen_aslant=0.0, dark_reach=2.0)
    rays, through_glass = static_rays(world, CASTERS[caster])
    measured, _ = front(rays, errors, scans=3, through_glass=through_glass)
    assert np.isnan(measured).all()


def test_the_same_share_of_all_beams_drops_out():
    measured, _ = front(wall(1.0), LidarErrors(dropout=0.1), scans=300)
    assert np.isnan(measured).mean() == pytest.approx(0.1, abs=0.02)


def test_no_beam_meets_the_robot_itself():
    height, x = SPEC.T_base_laser.t[2], SPEC.T_base_laser.t[0]
    for part in chassis.BODY:
        centre, size = np.array(part.centre), np.array(part.size)
        if abs(height - centre[2]) < 0.5 * size[2]:
            corners = [(centre[0] + i * size[0] / 2 - x, centre[1] + j * size[1] / 2) for i in (-1, 1) for j in (-1, 1)]
            bearings = [abs(math.atan2(side, ahead)) for ahead, side in corners]
            assert min(bearings) > max(abs(SPEC.angles))


def test_the_same_seed_gives_the_same_errors():
    runs = [front(wall(2.0), REALISMS["harsh"].lidar, scans=3, seed=9)[0] for _ in range(2)]
    assert np.array_equal(*runs, equal_nan=True)
