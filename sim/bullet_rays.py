"""Rays cast by the physics itself: slow, and the reference."""

from __future__ import annotations

import numpy as np

from sim.bodies import MOVABLE, WORLD
from sim.bullet import pybullet
from sim.lidar_kernel import Met
from sim.rays import Singles

BULLET_BATCH = 8192
"""Rays to a call: at its documented limit of 16384 PyBullet loses some (bullet3 #4215)."""


class BulletRays:
    """Rays against the bodies of a running physics, where they stand at the moment of the cast, by `rayTestBatch`.

    Everything is matte to them.
    """

    def __init__(self, client: int) -> None:
        self._client = client

    def cast(self, origins: Singles, directions: Singles, max_range: float) -> Singles:
        """See `Rays.cast`; origins and directions in the world."""
        return self.meet(origins, directions, max_range)[0]

    def meet(self, origins: Singles, directions: Singles, max_range: float) -> Met:
        """See `Rays.meet`."""
        ranges, cosines = np.full(len(origins), np.inf, np.float32), np.ones(len(origins), np.float32)
        ends = origins + np.float32(max_range) * directions
        for start in range(0, len(origins), BULLET_BATCH):
            batch = slice(start, start + BULLET_BATCH)
            hits = pybullet.rayTestBatch(origins[batch], ends[batch], collisionFilterMask=WORLD | MOVABLE, physicsClientId=self._client)
            fractions, normals = np.array([hit[2] for hit in hits], np.float32), np.array([hit[4] for hit in hits], np.float32)
            found = np.array([hit[0] >= 0 for hit in hits])
            ranges[batch][found] = fractions[found] * np.float32(max_range)
            cosines[batch][found] = np.abs((normals * directions[batch]).sum(axis=1))[found]
        return ranges, np.minimum(cosines, np.float32(1.0)), np.zeros(len(origins), np.int8)
