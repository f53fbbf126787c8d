"""Closing loops: which submaps are looked into, what must be seen twice, and the links that come of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from slam.mapping.recognition import LoopClosing, Recognition, recognise
from slam.mapping.submap import Submap
from slam.mapping.submaps import UNPACKED, Closure, Link, Submaps
from slam.mapping.uncertainty import composed, inverted
from slam.matching.branch_and_bound import ScorePyramid
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Here:
    """A scan, and where the robot is in the current submap."""

    current: int
    T_current_base: SE2
    covariance: FloatArray
    """(3, 3) of the body."""
    cloud: PointScan


@dataclass(frozen=True, slots=True, eq=False)
class _Sighting:
    """A submap recognised by searching: believed when the next sighting, of it or of another, says the same."""

    current: int
    T_map_current: SE2


class LoopCloser:
    """Ties the current submap to others in which the robot recognises where it is."""

    def __init__(self, settings: LoopClosing, submaps: Submaps) -> None:
        self._settings = settings
        self._submaps = submaps
        self._pyramids: dict[int, tuple[int, ScorePyramid]] = {}
        self._sighting: _Sighting | None = None

    def around(self, here: Here, radius: float) -> Iterator[Recognition]:
        """Submaps whose origin may lie within `radius` [m] and that are recognised, nearest first."""
        searches = 0
        for other, expected in self._candidates(here, radius):
            wide = self._settings.is_wide(expected[1])
            if wide and (searches >= self._settings.searches or self._submaps.tied(other.number, here.current)):
                continue
            searches += wide
            pyramid = self._pyramid(other) if wide else None
            found = recognise(self._settings, self._submaps.use(other.number), pyramid, here.cloud, expected)
            if found is not None and self._confirmed(found, here):
                yield found

    def anywhere(self, cloud: PointScan, T_map_base: SE2) -> Recognition | None:
        """The scan's place among all submaps: about the expected pose, else wherever only one submap knows it best."""
        near = np.diag([0.3, 0.3, 0.2]) ** 2
        far = np.diag([self._settings.farthest, self._settings.farthest, math.pi]) ** 2
        by_distance = sorted(self._submaps.all, key=lambda submap: _distance(submap.T_map_submap, T_map_base))
        for submap in by_distance[:3]:
            expected = (submap.T_map_submap.inverse() @ T_map_base, near)
            found = recognise(self._settings, self._submaps.use(submap.number), self._pyramid(submap), cloud, expected)
            if found is not None:
                return found
        found = [
            recognise(self._settings, self._submaps.use(submap.number), self._pyramid(submap), cloud, (SE2(), far))
            for submap in by_distance
        ]
        return max((one for one in found if one is not None), key=lambda one: one.known * one.inliers, default=None)

    def _candidates(self, here: Here, radius: float) -> list[tuple[Submap, tuple[SE2, FloatArray]]]:
        """Submaps whose region may hold the robot, nearest first, with the expected `T_submap_base` and its body covariance."""
        chains = self._submaps.relative(here.current)
        T_map_current = self._submaps[here.current].T_map_submap
        T_map_base = T_map_current @ here.T_current_base
        found: list[tuple[float, Submap, tuple[SE2, FloatArray]]] = []
        for other in self._submaps.all:
            if other.number == here.current or _distance(other.T_map_submap, T_map_base) >= radius + self._settings.farthest:
                continue
            T_other_current = other.T_map_submap.inverse() @ T_map_current
            relative = inverted(chains[other.number], T_other_current.inverse())
            expected, covariance = T_other_current @ here.T_current_base, composed(relative, here.T_current_base, here.covariance)
            distance, reach = math.hypot(expected.x, expected.y), 3.0 * math.sqrt(max(covariance[0, 0], covariance[1, 1]))
            if distance < radius + min(reach, self._settings.farthest):
                found.append((distance, other, (expected, covariance)))
        return [(other, place) for _, other, place in sorted(found, key=lambda item: item[0])]

    def _pyramid(self, submap: Submap) -> ScorePyramid:
        scans, pyramid = self._pyramids.pop(submap.number, (-1, None))
        if pyramid is None or scans != submap.scans:
            pyramid = ScorePyramid.of(submap.grid)
        self._pyramids[submap.number] = (submap.scans, pyramid)
        if len(self._pyramids) > UNPACKED:
            del self._pyramids[next(iter(self._pyramids))]
        return pyramid

    def _confirmed(self, found: Recognition, here: Here) -> bool:
        """What was searched for must be found twice, in the same place."""
        if not found.searched:
            return True
        T_map_current = self._submaps[found.submap].T_map_submap @ found.T_submap_base @ here.T_current_base.inverse()
        before, self._sighting = self._sighting, _Sighting(here.current, T_map_current)
        return before is not None and before.current == here.current and self._agree(before.T_map_current, T_map_current)

    def close(self, found: Recognition, here: Here) -> None:
        """Tie the two submaps and settle the graph; one link between two is enough."""
        if self._submaps.tied(found.submap, here.current):
            return
        T_base_current = here.T_current_base.inverse()
        Ad = here.T_current_base.adjoint()
        covariance = Ad @ (found.covariance + here.covariance) @ Ad.T
        T_other_current = found.T_submap_base @ T_base_current
        self._submaps.tie(Link(found.submap, here.current, T_other_current, covariance, closure=True, seen=self._seen(found, here)))
        self._submaps.settle()

    def believes(self, found: Recognition, here: Here) -> bool:
        """Whether the graph, which may have left the link out, has the robot there too."""
        T_map_base = self._submaps[here.current].T_map_submap @ here.T_current_base
        return self._agree(self._submaps[found.submap].T_map_submap.inverse() @ T_map_base, found.T_submap_base)

    def _agree(self, T_a_b: SE2, other: SE2) -> bool:
        change = T_a_b.inverse() @ other
        return math.hypot(change.x, change.y) < self._settings.agreement and abs(change.yaw) < 0.3 * self._settings.agreement

    def _seen(self, found: Recognition, here: Here) -> Closure | None:
        kept = self._submaps[found.submap].keyframes
        near = min(kept, key=lambda keyframe: _distance(keyframe.T_submap_base, found.T_submap_base), default=None)
        return None if near is None else Closure(near.stamp, here.cloud.stamp, near.T_submap_base.inverse() @ found.T_submap_base)


def _distance(T_map_a: SE2, T_map_b: SE2) -> float:
    return math.hypot(T_map_a.x - T_map_b.x, T_map_a.y - T_map_b.y)
