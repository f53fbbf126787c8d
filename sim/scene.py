"""World -> triangles for the rays."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.lidar_kernel import DARK, GLASS, GLOSSY, MATTE, Codes
from slam.se2 import SE2, FloatArray
from worlds.geometry import sides
from worlds.parts import Box, Cylinder, Wall
from worlds.world import Solid, World

Triangles = NDArray[np.float32]
"""(M, 3, 3): corners of M triangles [m]."""

CODES = {"matte": MATTE, "dark": DARK, "glossy": GLOSSY, "glass": GLASS}
"""Material of a solid -> what the lidar's kernels call it."""
FLATNESS = 1e-4
"""How far the sides of a cylinder may be inside its circle [m]."""


def static_triangles(world: World, *, glass: bool = True) -> Triangles:
    """Everything that never moves, in the world's frame, with panes or without."""
    meshes = [_placed(solid) for solid in static_solids(world, glass=glass)]
    return np.concatenate([np.empty((0, 3, 3)), *meshes]).astype(np.float32)


def movable_solids(world: World) -> list[Solid]:
    """What can be pushed about."""
    return [solid for solid in world.solids if solid.mass > 0.0]


def static_materials(world: World, *, glass: bool = True) -> Codes:
    """Material (M,) of each of the `static_triangles`."""
    codes = [np.full(len(_placed(solid)), CODES[solid.material], np.int8) for solid in static_solids(world, glass=glass)]
    return np.concatenate([np.empty(0, np.int8), *codes])


def standing_solids(world: World) -> list[Solid]:
    """Everything solid but what the clock moves: doors that stay as they are stand among it as boxes."""
    still = [door for door in world.doors if door.state != "swinging"]
    leaves = [
        Box(door.pose_at(0.0)[:2], (door.width, door.thickness, door.height), door.pose_at(0.0)[2], name="door", material=door.material)
        for door in still
    ]
    return [*world.solids, *leaves]


def outline(solid: Solid) -> FloatArray:
    """Sides (N, 4) as x0 y0 x1 y1 [m] in the world, counter-clockwise; of a cylinder one row: x, y of the middle, radius, 0."""
    if isinstance(solid, Cylinder):
        return np.array([[*solid.centre, solid.radius, 0.0]])
    x, y, _, yaw = middle(solid)
    return sides(SE2(x, y, yaw).transform(_footprint(solid)))


def body_triangles(solid: Solid) -> Triangles:
    """One solid in its own frame: origin in its middle, axes along its sides."""
    z_low, z_high = solid.z_span
    return upright_prism(_footprint(solid), 0.5 * (z_high - z_low)).astype(np.float32)


def box_size(solid: Wall | Box) -> tuple[float, float, float]:
    """Sides along the solid's own x, y, z [m]."""
    return solid.size if isinstance(solid, Box) else (solid.length, solid.thickness, solid.height)


def middle(solid: Solid) -> tuple[float, float, float, float]:
    """Where the solid's own frame is: x, y, z [m] of its middle, yaw [rad]."""
    yaw = 0.0 if isinstance(solid, Cylinder) else solid.yaw
    return (*solid.centre, 0.5 * sum(solid.z_span), yaw)


def static_solids(world: World, *, glass: bool = True) -> list[Solid]:
    """Everything that never moves, with panes or without."""
    return [solid for solid in standing_solids(world) if solid.mass == 0.0 and (glass or solid.material != "glass")]


def _placed(solid: Solid) -> NDArray[np.float64]:
    x, y, z, yaw = middle(solid)
    z_low, z_high = solid.z_span
    return upright_prism(SE2(x, y, yaw).transform(_footprint(solid)), 0.5 * (z_high - z_low)) + np.array([0.0, 0.0, z])


def _footprint(solid: Solid) -> NDArray[np.float64]:
    """Corners (N, 2) about the middle, counter-clockwise."""
    if isinstance(solid, Cylinder):
        sides = max(math.ceil(math.pi / math.acos(1.0 - min(FLATNESS / solid.radius, 0.5))), 8)
        angles = np.arange(sides) * (math.tau / sides)
        return solid.radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array(box_size(solid)[:2]) / 2


def upright_prism(footprint: NDArray[np.float64], half_height: float) -> NDArray[np.float64]:
    """Sides, bottom and top (M, 3, 3) [m] of an upright prism about z = 0 over a convex footprint (N, 2), counter-clockwise."""
    low = np.column_stack([footprint, np.full(len(footprint), -half_height)])
    high = low * [1.0, 1.0, -1.0]
    next_low, next_high = np.roll(low, -1, axis=0), np.roll(high, -1, axis=0)
    sides = np.concatenate([np.stack([low, next_low, next_high], 1), np.stack([low, next_high, high], 1)])
    fans = [np.stack([np.repeat(ring[:1], len(ring) - 2, 0), ring[1:-1], ring[2:]], 1) for ring in (high, low[::-1])]
    return np.concatenate([sides, *fans])
