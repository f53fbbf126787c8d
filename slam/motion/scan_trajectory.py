"""The poses at scans, as they are known."""

from __future__ import annotations

import numpy as np

from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray


class ScanTrajectory:
    """A growing trajectory; a scan with the stamp of its predecessor replaces it."""

    def __init__(self) -> None:
        self._rows: FloatArray = np.empty((256, 4))  # stamp, x, y, yaw
        self._count = 0
        self._frozen: Trajectory | None = None

    def __len__(self) -> int:
        return self._count

    def append(self, stamp: float, T_map_base: SE2) -> None:
        """Add the pose of a scan."""
        self._frozen = None
        if self._count == 0 or stamp > self._rows[self._count - 1, 0]:
            if self._count == len(self._rows):
                self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
            self._rows[self._count, 0] = stamp
            self._count += 1
        self._rows[self._count - 1, 1:] = T_map_base.as_array()

    def trajectory(self) -> Trajectory:
        """All poses so far, made once per scan."""
        if self._frozen is None:
            rows = self._rows[: self._count]
            self._frozen = Trajectory(rows[:, 0], rows[:, 1:])
        return self._frozen
