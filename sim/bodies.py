"""World -> PyBullet bodies. Collision groups decide what touches what, and rays see only the world."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sim.bullet import pybullet
from sim.scene import Triangles, box_size, middle, movable_solids, static_solids
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
PARTS = 16
"""Of one body: PyBullet leaves out more of them without a word."""


def add_floor(client: int) -> None:
    """Add the floor z = 0."""
    shape = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
    floor = pybullet.createMultiBody(0.0, shape, physicsClientId=client)
    pybullet.changeDynamics(floor, -1, lateralFriction=1.0, physicsClientId=client)
    set_group(floor, -1, FLOOR, client)


def add_world(world: World, client: int) -> list[int]:
    """Add everything that stands in the world; returns the ids of the movable bodies, in the order of `scene.movable_solids`.

    What never moves shares bodies: the physics goes through all of them in every step, though not through their parts.
    """
    fixed = static_solids(world)
    for first in range(0, len(fixed), PARTS):
        _add_fixed(fixed[first : first + PARTS], client)
    return [_add_movable(solid, client) for solid in movable_solids(world)]


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


def _add_fixed(solids: Sequence[Solid], client: int) -> None:
    """Add one body of solids, `PARTS` at most, that never move."""
    places = [_place(solid) for solid in solids]
    shape = pybullet.createCollisionShapeArray(
        shapeTypes=[pybullet.GEOM_CYLINDER if isinstance(solid, Cylinder) else pybullet.GEOM_BOX for solid in solids],
        halfExtents=[_half(solid) for solid in solids],
        radii=[solid.radius if isinstance(solid, Cylinder) else 0.0 for solid in solids],
        lengths=[solid.height if isinstance(solid, Cylinder) else 0.0 for solid in solids],
        collisionFramePositions=[position for position, _ in places],
        collisionFrameOrientations=[orientation for _, orientation in places],
        physicsClientId=client,
    )
    body = pybullet.createMultiBody(0.0, shape, useMaximalCoordinates=1, physicsClientId=client)
    pybullet.changeDynamics(body, -1, lateralFriction=FRICTION, physicsClientId=client)
    set_group(body, -1, WORLD, client)


def _add_movable(solid: Solid, client: int) -> int:
    if isinstance(solid, Cylinder):
        shape = pybullet.createCollisionShape(pybullet.GEOM_CYLINDER, radius=solid.radius, height=solid.height, physicsClientId=client)
    else:
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=_half(solid), physicsClientId=client)
    position, orientation = _place(solid)
    body = pybullet.createMultiBody(
        solid.mass,
        shape,
        basePosition=position,
        baseOrientation=orientation,
        useMaximalCoordinates=1,  # a plain rigid body: a quarter less time per step than a multibody without joints
        physicsClientId=client,
    )
    pybullet.changeDynamics(body, -1, lateralFriction=FRICTION, physicsClientId=client)
    set_group(body, -1, MOVABLE, client)
    return body


def _place(solid: Solid) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
    """Position and quaternion of a solid's middle."""
    x, y, z, yaw = middle(solid)
    return (x, y, z), (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))


def _half(solid: Solid) -> tuple[float, float, float]:
    """Half the sides of a box; zeros of a cylinder."""
    x, y, z = (0.0, 0.0, 0.0) if isinstance(solid, Cylinder) else box_size(solid)
    return 0.5 * x, 0.5 * y, 0.5 * z
