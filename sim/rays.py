"""Ray casters with one face: `embree` on triangles, `bullet` in the physics itself."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from sim.bodies import MOVABLE, WORLD
from sim.bullet import pybullet
from sim.scene import Triangles

Singles = NDArray[np.float32]

BULLET_BATCH = 8192
"""Rays to a call: at its documented limit of 16384 PyBullet loses some (bullet3 #4215)."""


class Rays(Protocol):
    """Something that rays can hit."""

    def cast(self, origins: Singles, directions: Singles, max_range: float) -> Singles:
        """Distance to the first hit (N,) [m] along rays of origins (N, 3) [m] and unit directions (N, 3); inf where nothing is hit."""
        ...


class EmbreeRays:
    """Rays against triangles that do not move in the rays' frame, by Intel Embree."""

    def __init__(self, triangles: Triangles) -> None:
        self._scene = EmbreeScene()
        TriangleMesh(self._scene, triangles)

    def cast(self, origins: Singles, directions: Singles, max_range: float) -> Singles:
        """See `Rays.cast`; origins and directions in the frame of the triangles."""
        ranges = self._scene.run(origins, directions, dists=max_range, query="DISTANCE")
        ranges[ranges >= np.float32(max_range)] = np.inf
        return ranges


class BulletRays:
    """Rays against the bodies of a running physics, where they stand at the moment of the cast, by `rayTestBatch`."""

    def __init__(self, client: int) -> None:
        self._client = client

    def cast(self, origins: Singles, directions: Singles, max_range: float) -> Singles:
        """See `Rays.cast`; origins and directions in the world."""
        ranges = np.full(len(origins), np.inf, np.float32)
        ends = origins + np.float32(max_range) * directions
        for start in range(0, len(origins), BULLET_BATCH):
            batch = slice(start, start + BULLET_BATCH)
            hits = pybullet.rayTestBatch(origins[batch], ends[batch], collisionFilterMask=WORLD | MOVABLE, physicsClientId=self._client)
            fractions = np.array([hit[2] for hit in hits], np.float32)
            found = np.array([hit[0] >= 0 for hit in hits])
            ranges[batch][found] = fractions[found] * np.float32(max_range)
        return ranges
