"""The paths of all particles, as a tree: what survivors share is kept once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.messages import Trajectory
from slam.se2 import FloatArray


class ParticlePaths:
    """Poses (N, 3) of every scan, and whose descendants the particles are."""

    def __init__(self, count: int) -> None:
        self._stamps: list[float] = []
        self._poses: list[FloatArray] = []
        self._parents: dict[int, NDArray[np.int64]] = {}
        self._count = count

    def append(self, stamp: float, poses: FloatArray) -> None:
        """Add the poses (N, 3) of a scan; one that is not newer than the last replaces it."""
        if self._stamps and stamp <= self._stamps[-1]:
            self._poses[-1] = poses
            return
        self._stamps.append(stamp)
        self._poses.append(poses)

    def resample(self, parents: NDArray[np.int64]) -> None:
        """From the next scan on particle n continues the path of `parents[n]` (N,)."""
        at = len(self._stamps)
        before = self._parents.get(at)
        self._parents[at] = parents if before is None else before[parents]

    def trajectory(self, particle: int) -> Trajectory:
        """One particle's path."""
        rows, n = np.empty((len(self._stamps), 3)), particle
        for k in range(len(self._stamps), 0, -1):
            if k in self._parents:
                n = int(self._parents[k][n])
            rows[k - 1] = self._poses[k - 1][n]
        return Trajectory(np.array(self._stamps), rows)
