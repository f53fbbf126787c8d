"""World -> PyBullet bodies. Collision groups decide what touches what, and rays see only the world."""

from __future__ import annotations

import math

import numpy as np

from sim.bullet import pybullet
from sim.scene import Triangles, box_size, middle, standing_solids
from worlds.parts import Cylinder
from worlds.world import Solid, World

RAYS, FLOOR, WORLD, MOVABLE, ROLLING, HULL = 1, 2, 4, 8, 16, 32
"""Collision groups. Rays are in PyBullet's default group; wheels and caster roll on the floor, the hull bumps into the rest."""
TOUCHES = {
    FLOOR: ROLLING | MOVABLE,
    WORLD: RAYS | HULL | MOVABLE,
    MOVABLE: RAYS | FLOOR | WORLD | MOVABLE | HULL,
    ROLLING: FLOOR,
    HULL: WORLD | MOVABLE,
}
FRICTION = 0.5
"""Lateral friction of walls and furniture; PyBullet multiplies the two of a contact."""


def add_floor(client: int) -> None:
    """Add the floor z = 0."""
    shape = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
    floor = pybullet.createMultiBody(0.0, shape, physicsClientId=client)
    pybullet.changeDynamics(floor, -1, lateralFriction=1.0, physicsClientId=client)
    set_group(floor, -1, FLOOR, client)


def add_world(world: World, client: int) -> list[int]:
    """Add everything that stands in the world; returns the ids of the movable bodies, in the order of `scene.movable_solids`."""
    bodies = [(solid.mass, _add_solid(solid, client)) for solid in standing_solids(world)]
    return [body for mass, body in bodies if mass > 0.0]


def add_moved(triangles: Triangles, client: int) -> int:
    """Add a body that is put where it belongs, see `move`: the convex hull of triangles (M, 3, 3) in its own frame."""
    corners = np.unique(triangles.reshape(-1, 3), axis=0).tolist()
    shape = pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=corners, physicsClientId=client)
    body = pybullet.createMultiBody(0.0, shape, useMaximalCoordinates=1, physicsClientId=client)
    pybullet.changeDynamics(body, -1, lateralFriction=FRICTION, physicsClientId=client)
    set_group(body, -1, WORLD, client)
    return body


def move(body: int, frame: list[float], client: int) -> None:
    """Put a body of `add_moved` to a frame of 12 numbers, rotation row by row and position, that is pitched and yawed but not rolled."""
    yaw, pitch = 0.5 * math.atan2(-frame[1], frame[4]), 0.5 * math.atan2(-frame[6], frame[8])
    (cy, sy), (cp, sp) = (math.cos(yaw), math.sin(yaw)), (math.cos(pitch), math.sin(pitch))
    quaternion = (-sy * sp, cy * sp, sy * cp, cy * cp)
    pybullet.resetBasePositionAndOrientation(body, frame[9:], quaternion, physicsClientId=client)


def set_group(body: int, link: int, group: int, client: int) -> None:
    """Put one link into a collision group."""
    pybullet.setCollisionFilterGroupMask(body, link, group, TOUCHES[group], physicsClientId=client)


def _add_solid(solid: Solid, client: int) -> int:
    x, y, z, yaw = middle(solid)
    body = pybullet.createMultiBody(
        solid.mass,
        _collision_shape(solid, client),
        basePosition=(x, y, z),
        baseOrientation=(0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)),
        useMaximalCoordinates=1,  # a plain rigid body: a quarter less time per step than a multibody without joints
        physicsClientId=client,
    )
    pybullet.changeDynamics(body, -1, lateralFriction=FRICTION, physicsClientId=client)
    set_group(body, -1, MOVABLE if solid.mass > 0.0 else WORLD, client)
    return body


def _collision_shape(solid: Solid, client: int) -> int:
    if isinstance(solid, Cylinder):
        return pybullet.createCollisionShape(pybullet.GEOM_CYLINDER, radius=solid.radius, height=solid.height, physicsClientId=client)
    half = [0.5 * side for side in box_size(solid)]
    return pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
