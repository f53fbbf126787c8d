"""World -> PyBullet bodies. Collision groups decide what touches what, and rays see only the world."""

from __future__ import annotations

import math

from sim.bullet import pybullet
from sim.scene import box_size, middle
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
    """Add everything that stands in the world; returns the ids of the movable bodies, in the order of `movable_solids`."""
    bodies = [(solid.mass, _add_solid(solid, client)) for solid in world.solids]
    return [body for mass, body in bodies if mass > 0.0]


def movable_solids(world: World) -> list[Solid]:
    """What can be pushed about."""
    return [solid for solid in world.solids if solid.mass > 0.0]


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
