import math

import numpy as np
import pytest
from msgspec import structs

from hardware.spec import LidarSpec
from scripts.bench.parity import level_sweeps
from sim.grid_rays import GridRays
from sim.lidar import embree_rays, grid_rays
from sim.living import Living
from sim.motion import Motion
from sim.moving import living_bodies, moving_bodies
from sim.rays import EmbreeRays
from sim.scene import body_triangles
from slam.se3 import SE3
from worlds.living import Door, Person
from worlds.loader import load_world, world_names
from worlds.parts import Box, Cylinder

REACH = 5.6
NOTHING = np.full(682, np.inf, np.float32), np.ones(682, np.float32), np.zeros(682, np.int8)


def pitched(directions, angle):
    c, s = math.cos(angle), math.sin(angle)
    return (directions @ np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])).astype(np.float32)


def away(met, expected):
    """Differences of ranges (N,) [m]; what is not met counts as `REACH`."""
    return np.abs(np.minimum(met[0], REACH) - np.minimum(expected[0], REACH))


@pytest.mark.parametrize("name", world_names())
def test_grid_rays_meet_in_every_world_what_embree_meets(name):
    world = load_world(name)
    flat = structs.replace(world, cylinders=())
    for angle in (0.0, 0.03, -0.2):
        for part, limit in ((flat, 1e-4), (world, 1e-3)):
            grid, embree = grid_rays(part), embree_rays(part)
            for origins, directions in level_sweeps(part, 4, 3):
                rays = origins, pitched(directions, angle)
                met, expected = grid.meet(*rays, REACH), embree.meet(*rays, REACH)
                assert (
                    np.mean(away(met, expected) <= limit) > 0.996
                )  # the rest beside edges, where a cylinder is round and a polygon is not
                assert np.mean(met[2] == expected[2]) > 0.996
                assert part is world or np.mean(np.abs(met[1] - expected[1]) < 1e-3) > 0.996


def test_grid_rays_need_no_order(room):
    world = room(boxes=(Box((1.0, 0.5), (0.6, 0.3, 0.8), yaw=0.4),), cylinders=(Cylinder((-0.9, 0.9), 0.3, 0.4),))
    rng = np.random.default_rng(1)
    origins, directions = rng.uniform(-1.4, 1.4, (3000, 3)), rng.standard_normal((3000, 3))
    origins[:, 2] = rng.uniform(0.0, 1.0, 3000)
    rays = origins.astype(np.float32), (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
    met, expected = grid_rays(world).meet(*rays, REACH), embree_rays(world).meet(*rays, REACH)
    assert np.mean(away(met, expected) < 1e-3) > 0.995


@pytest.mark.parametrize("turn", [1, -1])
def test_sweeps_may_run_either_way_and_over_any_heading(room, turn):
    world = room(boxes=(Box((1.0, 0.5), (0.6, 0.3, 0.8), yaw=0.4),))
    grid, embree = grid_rays(world), embree_rays(world)
    for start in np.linspace(0.0, math.tau, 9):
        angles = start + turn * np.linspace(0.0, 6.2, 400)
        directions = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(400)]).astype(np.float32)
        origins = np.tile(np.array([0.1, 0.2, 0.18], np.float32), (400, 1))
        assert away(grid.meet(origins, directions, REACH), embree.meet(origins, directions, REACH)).max() < 1e-4


def test_grid_rays_come_in_from_outside_and_pass_by():
    rays = GridRays([Box((0.5, 0.5), (1.0, 1.0, 1.0), material="dark")])
    origins = np.array([[-3.0, 0.5, 0.5], [0.5, 4.0, 0.5], [-3.0, 3.0, 0.5], [-3.0, -0.1, 0.5], [0.5, 0.5, 3.0]], np.float32)
    directions = np.array([[1, 0, 0], [0, -1, 0], [1, 0, 0], [1, 0, 0], [0, 0, -1]], np.float32)
    ranges, cosines, materials = rays.meet(origins, directions, 5.0)
    assert ranges == pytest.approx([3.0, 3.0, math.inf, math.inf, 2.0], abs=1e-6)
    assert cosines == pytest.approx(1.0)
    assert materials.tolist() == [1, 1, 0, 0, 1]
    assert rays.cast(origins, directions, 2.9)[0] == math.inf


def test_there_may_be_nothing_to_see_and_no_ray():
    origins, directions = np.zeros((2, 3), np.float32), np.array([[1, 0, 0], [0, 1, 0]], np.float32)
    assert np.all(GridRays([]).cast(origins, directions, 5.0) == np.inf)
    assert GridRays([Box((2.0, 0.0), (1.0, 1.0, 1.0))]).cast(origins[:0], directions[:0], 5.0).shape == (0,)


def still_motion(bodies=()):
    motion = Motion(len(bodies), SE3())
    motion.append([(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, *(number for body in bodies for number in body))] * 60)
    return motion


def placed(triangles, frame):
    return (triangles.astype(np.float64) @ frame[:9].reshape(3, 3).T + frame[9:]).astype(np.float32)


@pytest.mark.parametrize("angle", [0.0, 0.02, -0.02])
def test_people_and_doors_are_met_where_embree_meets_their_triangles(room, angle):
    people = tuple(Person(path=((x, -1.0), (x, 1.0)), speed=1.0, seed=k) for k, x in enumerate((-1.2, 0.8, 1.4)))
    living = Living(structs.replace(room(), people=people, doors=(Door((-1.8, 0.5), 0.3, 0.7, state="swinging"),)))
    for tick in range(60):
        living.tick(10 * tick, 100.0, 100.0)
    (bodies,) = living_bodies(living, LidarSpec())
    for t in (0.2, 0.55, 0.9):
        frames = living.frames(t, t).values[:, 0]
        embree = EmbreeRays(np.concatenate([placed(part.triangles, frame) for part, frame in zip(living.parts, frames, strict=True)]))
        for origins, directions in level_sweeps(room(), 10, 3):
            rays, met = (origins, pitched(directions, angle)), tuple(values.copy() for values in NOTHING)
            bodies.meet(still_motion(), (t, 0.0, t), rays, met, REACH)
            expected = embree.meet(*rays, REACH)
            reached = np.abs(rays[1][:, 2]) * np.minimum(expected[0], REACH) < 0.1  # no more is promised of who is far above or below
            assert np.mean(away(met, expected)[reached] < 1e-3) > 0.996


def test_what_can_be_pushed_is_met_in_any_position_where_embree_meets_its_triangles(room):
    solids = Box((1.0, 0.0), (0.3, 0.5, 0.4), mass=1.0), Cylinder((-1.0, 0.5), 0.2, 0.5, mass=1.0)
    (bodies,) = moving_bodies(room(boxes=solids[:1], cylinders=solids[1:]))
    poses = SE3.from_xyz_rpy((1.0, 0.2, 0.2), (0.3, -0.4, 1.0)), SE3.from_xyz_rpy((-0.9, 0.4, 0.2), (1.2, 0.1, 0.5))
    motion = still_motion([(*pose.t, *pose.quaternion()) for pose in poses])
    frames = [np.array([*np.ravel(pose.R), *pose.t]) for pose in poses]
    embree = EmbreeRays(np.concatenate([placed(body_triangles(solid), frame) for solid, frame in zip(solids, frames, strict=True)]))
    for origins, directions in level_sweeps(room(), 20, 3):
        met = tuple(values.copy() for values in NOTHING)
        bodies.meet(motion, (0.0, 1e-4, 0.06), (origins, directions), met, REACH)
        assert np.mean(away(met, embree.meet(origins, directions, REACH)) < 1e-3) > 0.996
