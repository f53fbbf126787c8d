"""The submap that the robot is in, and the next one, which is begun before it leaves."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slam.mapping.grid_mapper import MapSettings
from slam.mapping.region import Region
from slam.mapping.submap import Submap
from slam.mapping.submaps import Link, Submaps
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Next:
    """A submap in the making: not yet the one that is tracked in."""

    submap: Submap
    T_current_next: SE2


class SubmapChain:
    """Scans go into the current submap and the next one, so that this is a map already when the robot goes over into it."""

    def __init__(self, region: Region, settings: MapSettings, submaps: Submaps) -> None:
        self._region, self._settings, self.submaps = region, settings, submaps
        self.current = 0
        """Number of the submap that the robot is in."""
        self.too_large = False
        """A scan did not fit into the largest map."""
        self._next: _Next | None = None
        self._spacing = 0.1  # way from one inserted scan to the next, lately [m]

    @property
    def here(self) -> Submap:
        """The current submap."""
        return self.submaps[self.current]

    @property
    def all(self) -> list[Submap]:
        """All submaps, the next one too."""
        return self.submaps.all + ([self._placed_next()] if self._next else [])

    def begin(self, stamp: float, T_map_base: SE2) -> None:
        """The first submap lies where the robot starts."""
        self.submaps.add(Submap(0, stamp, T_map_base, self._settings))

    def enter(self, number: int) -> None:
        """Go on in another submap."""
        self.current, self._next = number, None

    def insert(self, cloud: PointScan, pose: SE2, before: SE2 | None) -> None:
        """Take in a scan at `T_current_base`; `before` is that of the scan before it."""
        current = self.here
        self.too_large |= not current.insert(pose, cloud)
        if before is not None:
            step = before.inverse() @ pose
            self._spacing += 0.1 * (math.hypot(step.x, step.y) - self._spacing)
        self._region.keep(current, cloud, pose)
        if self._next is not None:
            T_next_base = self._next.T_current_next.inverse() @ pose
            self._next.submap.insert(T_next_base, cloud)
            if self._region.is_full(current):
                self._region.keep(self._next.submap, cloud, T_next_base)

    def move_on(self, cloud: PointScan, pose: SE2, drift: tuple[FloatArray, FloatArray]) -> SE2 | None:
        """Begin the next submap towards the border of this one, and go over into it behind.

        Args:
            cloud: the scan that was inserted.
            pose: its `T_current_base`.
            drift: covariances (3, 3) of the body's pose, of one scan's place among the others and of slipping from submap to submap.

        Returns:
            `T_new_current` where the robot has gone over.
        """
        current, region = self.here, self._region
        if region.covers(current, pose, region.overlap):
            self._next = None
        elif self._next is None:
            self._next = _Next(Submap(len(self.submaps), cloud.stamp, current.T_map_submap @ pose, self._settings), pose)
            self._next.submap.insert(SE2(), cloud)
        return self._adopt(self._next, drift) if self._next is not None and not region.covers(current, pose) else None

    def _adopt(self, following: _Next, drift: tuple[FloatArray, FloatArray]) -> SE2:
        T_current_next = following.T_current_next
        self.submaps.add(self._placed_next())
        steps = 1.0 + math.hypot(T_current_next.x, T_current_next.y) / max(self._spacing, 0.01)
        self.submaps.tie(Link(self.current, following.submap.number, T_current_next, drift[0] * steps + drift[1], closure=False))
        self.enter(following.submap.number)
        return T_current_next.inverse()

    def _placed_next(self) -> Submap:
        assert self._next is not None
        self._next.submap.T_map_submap = self.here.T_map_submap @ self._next.T_current_next
        return self._next.submap
