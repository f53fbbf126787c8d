import math

import numpy as np
import pytest

from scripts.bench.parity import flat_parity, round_parity
from sim import bodies
from sim.bullet import pybullet
from sim.bullet_rays import BULLET_BATCH, BulletRays
from sim.rays import EmbreeRays
from sim.scene import static_triangles
from worlds.loader import load_world, world_names
from worlds.parts import Box, Cylinder
from worlds.world import World


@pytest.fixture
def client():
    client = pybullet.connect(pybullet.DIRECT)
    yield client
    pybullet.disconnect(client)


def casters(world, client):
    bodies.add_floor(client)
    bodies.add_world(world, client)
    return EmbreeRays(static_triangles(world)), BulletRays(client)


def test_embree_sees_boxes_and_planes_as_bullet_does(room):
    parity = flat_parity(room(boxes=(Box((1.0, 0.5), (0.6, 0.3, 0.8), yaw=0.4), Box((-1.0, -0.6), (0.3, 0.3, 0.5), yaw=-1.0))), 15)
    assert parity.errors.size > 10_000
    assert parity.share_within(0.001) >= 0.995
    assert parity.rest_beside_edges(0.001) == 1.0


def test_embree_sees_cylinders_as_bullet_does(room):
    columns = (Cylinder((1.0, 0.5), 0.15, 1.0), Cylinder((-1.0, -0.6), 0.025, 0.7), Cylinder((-0.9, 0.9), 0.3, 0.4))
    parity = round_parity(room(cylinders=columns), 15)
    assert parity.errors.size > 500
    assert parity.share_within(0.005) >= 0.99
    assert parity.rest_beside_edges(0.005) == 1.0


def has_slanting_sides(world: World) -> bool:
    """Bullet's own rays end up to 1.5 mm before one now and then."""
    sides = np.array([np.subtract(wall.end, wall.begin) for wall in world.walls])
    return bool(np.abs(sides).min(axis=1).max() > 0.01) or any(math.remainder(box.yaw, math.pi / 2.0) for box in world.boxes)


@pytest.mark.parametrize("name", world_names())
def test_embree_sees_every_world_as_bullet_does(name):
    world = load_world(name)
    flat = flat_parity(world, 10)
    assert flat.share_within(0.001) >= 0.995
    assert flat.rest_beside_edges(0.002 if has_slanting_sides(world) else 0.001) == 1.0
    if world.cylinders:
        assert round_parity(world, 20).share_within(0.005) >= 0.99


@pytest.mark.parametrize("caster", [0, 1], ids=["embree", "bullet"])
def test_a_distance_is_exact_and_nothing_is_infinite(room, client, caster):
    rays = casters(room(), client)[caster]
    origins = np.array([[0.0, 0.0, 0.2], [1.0, 0.0, 0.2], [0.0, 0.0, 2.0]], np.float32)
    directions = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]], np.float32)
    assert rays.cast(origins, directions, 5.6) == pytest.approx([2.0, 1.5, np.inf], abs=1e-4)


@pytest.mark.parametrize("caster", [0, 1], ids=["embree", "bullet"])
def test_what_is_beyond_the_reach_is_infinite(room, client, caster):
    rays = casters(room(), client)[caster]
    ray = np.array([[0.0, 0.0, 0.2]], np.float32), np.array([[1.0, 0.0, 0.0]], np.float32)
    assert rays.cast(*ray, 1.9) == [np.inf]


def test_bullet_takes_more_rays_than_one_batch_holds(room, client):
    bullet = casters(room(), client)[1]
    count = BULLET_BATCH + 5
    origins, directions = np.zeros((count, 3), np.float32), np.tile(np.array([1.0, 0.0, 0.0], np.float32), (count, 1))
    origins[:, 2] = 0.2
    assert bullet.cast(origins, directions, 5.6) == pytest.approx(np.full(count, 2.0), abs=1e-4)
