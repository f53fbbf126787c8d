"""How far Embree's ranges are from `rayTestBatch`'s in the same static world."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from sim.bodies import add_floor, add_world
from sim.bullet import pybullet
from sim.bullet_rays import BulletRays
from sim.rays import EmbreeRays, Singles
from sim.scene import static_triangles
from worlds.world import World

HEIGHT = 0.18
BEAMS = 682
REACH = 5.6
STEP = 4.18 / (BEAMS - 1)
"""Angle from beam to beam [rad]."""
CREASE = 1e-4
"""Ranges that are so far from those of one plane, as a share, have an edge between them."""
JUMP = 0.02
"""Ranges that bend by more than this from beam to beam (second difference) have an edge even on a curved surface [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Parity:
    """Differences of many rays; those that find nothing count as `REACH`."""

    errors: NDArray[np.float64]
    """(N,) |embree - bullet| [m]"""
    beside_edge: NDArray[np.bool_]
    """(N,) whether Embree's ranges have an edge at the beam or at one of its neighbours."""

    def share_within(self, tolerance: float) -> float:
        """Share of rays whose ranges differ by `tolerance` [m] at most."""
        return float(np.mean(self.errors <= tolerance))

    def rest_beside_edges(self, tolerance: float) -> float:
        """Share of the other rays that are within one beam of an edge; 1 where there are none."""
        rest = self.beside_edge[self.errors > tolerance]
        return float(rest.mean()) if rest.size else 1.0


def without_movable(world: World) -> World:
    """The part of a world that never moves."""
    boxes, cylinders = ([solid for solid in solids if solid.mass == 0.0] for solids in (world.boxes, world.cylinders))
    return structs.replace(world, boxes=tuple(boxes), cylinders=tuple(cylinders))


def flat_parity(world: World, sweeps: int, seed: int = 0) -> Parity:
    """Parity on walls and boxes: the world without its cylinders."""
    return _compare(structs.replace(without_movable(world), cylinders=()), sweeps, seed, None)


def round_parity(world: World, sweeps: int, seed: int = 0) -> Parity:
    """Parity of the rays that Embree sees end on a cylinder."""
    world = without_movable(world)
    behind = EmbreeRays(static_triangles(structs.replace(world, cylinders=())))
    return _compare(world, sweeps, seed, behind)


@contextmanager
def physics_of(world: World) -> Iterator[int]:
    """A physics client in which the world stands."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        add_floor(client)
        add_world(world, client)
        yield client
    finally:
        pybullet.disconnect(client)


def level_sweeps(world: World, count: int, seed: int) -> Iterator[tuple[Singles, Singles]]:
    """Origins and directions (682, 3) of level sweeps from free places."""
    rng = np.random.default_rng(seed)
    x0, y0, x1, y1 = world.bounds
    while count:
        x, y = rng.uniform(x0, x1), rng.uniform(y0, y1)
        angles = rng.uniform(-np.pi, np.pi) + STEP * (np.arange(BEAMS) - (BEAMS - 1) / 2)
        if world.clearance((x, y), (x, y)) >= 0.05:
            directions = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(BEAMS)])
            yield np.tile(np.array([x, y, HEIGHT], np.float32), (BEAMS, 1)), directions.astype(np.float32)
            count -= 1


def _compare(world: World, sweeps: int, seed: int, behind: EmbreeRays | None) -> Parity:
    errors: list[NDArray[np.float64]] = []
    beside: list[NDArray[np.bool_]] = []
    with physics_of(world) as client:
        embree, bullet = EmbreeRays(static_triangles(world)), BulletRays(client)
        for origins, directions in level_sweeps(world, sweeps, seed):
            e, b = (np.minimum(rays.cast(origins, directions, REACH), REACH).astype(np.float64) for rays in (embree, bullet))
            edge = _creases(e) if behind is None else _jumps(e)
            chosen = np.ones(BEAMS, bool) if behind is None else e < behind.cast(origins, directions, REACH) - 1e-4
            chosen[[0, 1, -2, -1]] = False
            errors.append(np.abs(e - b)[chosen])
            beside.append((np.roll(edge, 1) | edge | np.roll(edge, -1))[chosen])
    return Parity(np.concatenate(errors), np.concatenate(beside))


def _creases(ranges: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Beams (N,) that do not lie in one plane with their neighbours: along a plane 1/r is a sine of the beam's angle."""
    u = 1.0 / ranges
    return np.abs(np.roll(u, 1) + np.roll(u, -1) - 2.0 * np.cos(STEP) * u) > CREASE * u


def _jumps(ranges: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Beams (N,) with a neighbour at another depth."""
    return np.abs(np.roll(ranges, 1) - 2.0 * ranges + np.roll(ranges, -1)) > JUMP
