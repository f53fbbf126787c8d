"""Bodies that move while the lidar sweeps: what can be pushed, and what the clock moves."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from hardware.spec import LidarSpec
from sim import hull_kernel, kernels
from sim.lidar_kernel import Met
from sim.living import Living
from sim.motion import BODIES, STEP, Frames, Motion
from sim.rays import Singles, planes_of
from sim.scene import CODES, body_triangles, movable_solids
from slam.se2 import FloatArray
from worlds.parts import Box, Cylinder, Material
from worlds.world import Solid, World

TILT = 0.1
"""How far above or below its own height the lidar sees people and doors, because the robot pitches and rolls a little [m]."""
REACH = 1.2
"""Whom the lidar sees is nearer than this share of its maximum range."""
SAME = 6
"""Digits to which planes are the same."""
Path = Callable[[Motion, float, float], Frames]
"""Frames of some bodies (P, K, 12) between two times [s] of an episode."""


class Hull(NamedTuple):
    """A convex piece of a body."""

    body: int
    triangles: FloatArray
    """(M, 3, 3) in the body's frame [m], counter-clockwise from outside."""
    material: Material
    tube: float = math.inf
    """Radius of an upright tube about the frame's origin that cuts the piece: instead of many sides [m]."""


class MovingBodies:
    """Rigid bodies made of convex pieces that rays hit in the bodies' own frames, each at its own time."""

    def __init__(self, hulls: Sequence[Hull], frames: Path) -> None:
        self._frames = frames
        faces = [_faces(hull.triangles) for hull in hulls]
        ends = np.cumsum([len(own) for own in faces], dtype=np.int64)
        spans = [(hull.body, end - len(own), end) for hull, own, end in zip(hulls, faces, ends.tolist(), strict=True)]
        planes, corners = [plane for own in faces for plane, _ in own], [corner for own in faces for _, corner in own]
        firsts = np.cumsum([0, *map(len, corners)], dtype=np.int64)
        spheres = np.array([(*_sphere(hull.triangles), hull.tube) for hull in hulls])
        codes = np.array([CODES[hull.material] for hull in hulls], np.int8)
        self._hulls = (np.array(planes), firsts), np.concatenate(corners), np.array(spans, np.int64), spheres, codes

    def meet(self, motion: Motion, times: tuple[float, float, float], rays: tuple[Singles, Singles], met: Met, reach: float) -> None:
        """Replace what beams have `met` by these bodies where those are nearer.

        Args:
            motion: of the episode.
            times: of the first beam, from beam to beam, and of the last beam [s].
            rays: origins (N, 3) [m] and unit directions (N, 3) in the world.
            met: what each beam has met so far; changed in place.
            reach: [m]
        """
        frames = self._frames(motion, times[0], times[2])
        places = (times[0] - frames.first) / frames.step, times[1] / frames.step
        hull_kernel.meet(self._hulls, frames.values, places, rays, met, reach)


def moving_bodies(world: World) -> list[MovingBodies]:
    """Everything that can be pushed, if there is anything."""
    solids = movable_solids(world)
    hulls = [_pushable(k, solid) for k, solid in enumerate(solids)]
    return [MovingBodies(hulls, lambda motion, start, end: _pushed(motion, len(solids), start, end))] if solids else []


def living_bodies(living: Living, spec: LidarSpec) -> list[MovingBodies]:
    """The parts of people and doors that come to the lidar's height, if there are any."""
    height = float(spec.T_base_laser.t[2])
    chosen = living.parts_between(height - TILT, height + TILT)
    parts = [living.parts[k] for k in chosen]
    hulls = [Hull(k, triangles, part.material) for k, part in enumerate(parts) for triangles, _ in part.meshes]

    def frames(motion: Motion, start: float, end: float) -> Frames:
        x, y = motion.row_at(start)[:2].tolist()
        everything = living.frames(start, end, (x, y, REACH * spec.range_max))
        return everything._replace(values=everything.values[chosen])

    return [MovingBodies(hulls, frames)] if parts else []


def _pushable(number: int, solid: Solid) -> Hull:
    if isinstance(solid, Cylinder):
        around = Box(solid.centre, (2.0 * solid.radius, 2.0 * solid.radius, solid.height), z=solid.z)
        return Hull(number, body_triangles(around).astype(np.float64), solid.material, solid.radius)
    return Hull(number, body_triangles(solid).astype(np.float64), solid.material)


def _faces(triangles: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Plane (4,) and corners (C, 3) of each face of a convex hull; the most different planes come first: most misses are soon found."""
    planes = planes_of(triangles)
    kept = np.linalg.norm(planes[:, :3], axis=1) > 0.5
    planes, owners = np.unique(np.round(planes[kept], SAME), axis=0, return_inverse=True)
    corners = [np.unique(triangles[kept][owners.ravel() == k].reshape(-1, 3), axis=0) for k in range(len(planes))]
    order = [int(np.argmax(planes[:, 0]))]
    likeness = planes[:, :3] @ planes[order[0], :3]
    for _ in range(len(planes) - 1):
        order.append(int(np.argmin(likeness)))
        likeness = np.maximum(likeness, planes[:, :3] @ planes[order[-1], :3])
        likeness[order] = np.inf
    return [(planes[k], corners[k]) for k in order]


def _sphere(triangles: FloatArray) -> FloatArray:
    """Middle and radius (4,) of a sphere that holds a hull."""
    corners = triangles.reshape(-1, 3)
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    return np.array([*middle, np.linalg.norm(corners - middle, axis=1).max()])


def _pushed(motion: Motion, count: int, start: float, end: float) -> Frames:
    rows, first = motion.poses_between(start, end, BODIES, count)
    poses = rows.reshape(-1, count, 7).swapaxes(0, 1).reshape(-1, 7)
    return Frames(kernels.frames_of(poses).reshape(count, -1, 12), first, STEP)
