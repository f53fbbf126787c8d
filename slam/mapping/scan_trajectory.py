"""The poses at scans, as they are known."""

from __future__ import annotations

import numpy as np

from slam.messages import Trajectory
from slam.se2 import SE2


class ScanTrajectory:
    """A growing trajectory; a scan with the stamp of its predecessor replaces it."""

    def __init__(self) -> None:
        self._stamps: list[float] = []
        self._poses: list[SE2] = []

    def __len__(self) -> int:
        return len(self._stamps)

    def append(self, stamp: float, T_map_base: SE2) -> None:
        """Add the pose of a scan."""
        if self._stamps and stamp <= self._stamps[-1]:
            self._poses[-1] = T_map_base
            return
        self._stamps.append(stamp)
        self._poses.append(T_map_base)

    def trajectory(self) -> Trajectory:
        """All poses so far."""
        return Trajectory(np.array(self._stamps), np.array([pose.as_array() for pose in self._poses]).reshape(-1, 3))
