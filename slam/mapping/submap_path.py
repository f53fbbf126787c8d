"""The poses at scans, each in the frame of the submap that it was matched to, so that they move with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slam.evaluation.poses import compose
from slam.mapping.submap import Submap
from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray


class SubmapPath:
    """A growing trajectory; a scan with the stamp of its predecessor replaces it."""

    def __init__(self) -> None:
        self._rows: FloatArray = np.empty((256, 4))  # stamp, x, y, yaw in the submap
        self._submaps: NDArray[np.int32] = np.empty(256, np.int32)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def append(self, stamp: float, submap: int, T_submap_base: SE2) -> None:
        """Add the pose of a scan."""
        if self._count == 0 or stamp > self._rows[self._count - 1, 0]:
            if self._count == len(self._rows):
                self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
                self._submaps = np.concatenate([self._submaps, np.empty_like(self._submaps)])
            self._rows[self._count, 0] = stamp
            self._count += 1
        self._rows[self._count - 1, 1:] = T_submap_base.as_array()
        self._submaps[self._count - 1] = submap

    @property
    def stamps(self) -> FloatArray:
        """Of the scans, (N,) [s]."""
        return self._rows[: self._count, 0]

    @property
    def submaps(self) -> NDArray[np.int32]:
        """The submap of each pose, (N,)."""
        return self._submaps[: self._count]

    @property
    def poses(self) -> FloatArray:
        """In the submaps' frames, (N, 3)."""
        return self._rows[: self._count, 1:]

    def trajectory(self, submaps: Sequence[Submap]) -> Trajectory:
        """All poses so far in the map, where the submaps now are."""
        if self._count == 0:
            return Trajectory(np.empty(0), np.empty((0, 3)))
        origins = np.array([submap.T_map_submap.as_array() for submap in submaps])
        return Trajectory(self.stamps, compose(origins[self.submaps], self.poses))
