import numpy as np
import pybullet
import pytest

from sim import bodies
from sim.rays import BULLET_BATCH, BulletRays, EmbreeRays
from sim.scene import static_triangles
from worlds.loader import load_world
from worlds.parts import Box, Cylinder

LIDAR_HEIGHT = 0.18
BEAMS = 682


@pytest.fixture
def client():
    client = pybullet.connect(pybullet.DIRECT)
    yield client
    pybullet.disconnect(client)


def casters(world, client):
    bodies.add_floor(client)
    bodies.add_world(world, client)
    return EmbreeRays(static_triangles(world)), BulletRays(client)


def sweeps(world, count, seed=0):
    """Origins and directions of level sweeps from free places."""
    rng = np.random.default_rng(seed)
    x0, y0, x1, y1 = world.bounds
    while count:
        x, y = rng.uniform(x0 + 0.2, x1 - 0.2), rng.uniform(y0 + 0.2, y1 - 0.2)
        if world.clearance((x, y), (x, y)) < 0.05:
            continue
        count -= 1
        angles = rng.uniform(-np.pi, np.pi) + np.linspace(-2.09, 2.09, BEAMS)
        directions = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(BEAMS)]).astype(np.float32)
        yield np.tile(np.array([x, y, LIDAR_HEIGHT], np.float32), (BEAMS, 1)), directions


def differences(world, client, count=12):
    """Differences |embree - bullet| [m], and whether each lies between Embree's neighbouring beams."""
    embree, bullet = casters(world, client)
    errors, explained = [], []
    for origins, directions in sweeps(world, count):
        e = np.minimum(embree.cast(origins, directions, 5.6), 6.0)
        b = np.minimum(bullet.cast(origins, directions, 5.6), 6.0)
        neighbours = np.stack([np.roll(e, 1), e, np.roll(e, -1)])
        errors.append(np.abs(e - b)[1:-1])
        explained.append(((b >= neighbours.min(0) - 0.005) & (b <= neighbours.max(0) + 0.005))[1:-1])
    return np.concatenate(errors), np.concatenate(explained)


def test_embree_sees_boxes_and_planes_as_bullet_does(room, client):
    world = room(boxes=(Box((1.0, 0.5), (0.6, 0.3, 0.8), yaw=0.4), Box((-1.0, -0.6), (0.3, 0.3, 0.5), yaw=-1.0)))
    errors, explained = differences(world, client)
    assert np.mean(errors <= 0.001) >= 0.995
    assert np.all(explained[errors > 0.001])


def test_embree_sees_cylinders_as_bullet_does(room, client):
    world = room(cylinders=(Cylinder((1.0, 0.5), 0.15, 1.0), Cylinder((-1.0, -0.6), 0.025, 0.7), Cylinder((-0.9, 0.9), 0.3, 0.4)))
    errors, explained = differences(world, client)
    assert np.mean(errors <= 0.005) >= 0.99
    assert np.all(explained[errors > 0.005])


def test_embree_sees_the_aruco_room_as_bullet_does(client):
    world = load_world("aruco_room")
    movable = {solid.name for solid in bodies.movable_solids(world)}
    assert movable == {"parcel"}
    fixed = type(world)(
        **{name: getattr(world, name) for name in world.__struct_fields__} | {"boxes": tuple(b for b in world.boxes if not b.mass)}
    )
    errors, explained = differences(fixed, client)
    assert np.mean(errors <= 0.005) >= 0.99
    assert np.all(explained[errors > 0.005])


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
