"""What scans and markers say of the robot's place."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slam.landmarks.marker_bundle import Prior
from slam.landmarks.marker_location import UNKNOWN
from slam.mapping.lidar_slam import LidarSlamPipeline
from slam.mapping.uncertainty import composed, from_body, to_body
from slam.mapping.visual_slam import VisualSlamPipeline
from slam.se2 import SE2, FloatArray

JUMP = 0.02
"""A lidar pose that moves by more than this [m, rad] beside the odometry when it goes over into another submap is a correction."""
WEAKEST = 0.3
"""Deviation beyond which markers say nothing of a place [m, rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A pose that was found."""

    stamp: float
    T_map_base: SE2
    covariance: FloatArray
    """(3, 3) of (x, y, yaw), in the map."""

    def carried(self, stamp: float, step: SE2, covariance: FloatArray) -> Place:
        """The pose after a step with a covariance (3, 3) of its own."""
        pose = self.T_map_base @ step
        body = composed(to_body(self.covariance, self.T_map_base), step, to_body(covariance, step))
        return Place(stamp, pose, from_body(body, pose))

    def moved(self, T_new_map: SE2) -> Place:
        """The same pose in another map."""
        pose = T_new_map @ self.T_map_base
        return Place(self.stamp, pose, from_body(to_body(self.covariance, self.T_map_base), pose))


class LidarPlaces:
    """Poses at scans in a frame that does not jump; `T_map_frame` jumps instead when the lidar's map is put right."""

    def __init__(self, lidar: LidarSlamPipeline) -> None:
        self._lidar = lidar
        self.T_map_frame = SE2()
        self._known: tuple[int, SE2] | None = None
        """Number of the submap and its pose in the map at the last scan."""
        self._last: tuple[float, SE2] | None = None
        """Stamp and pose in the map of the last scan."""

    @property
    def submap(self) -> int:
        """Number of the submap that the newest scan was matched to."""
        return self._lidar.current

    def newest(
        self, stamp: float, predicted: Callable[[float], SE2], stepped: Callable[[float, float], tuple[SE2, FloatArray]]
    ) -> Place | None:
        """The pose at the newest scan, in the frame; None where it could not be matched, or there is none.

        Args:
            stamp: of the scan [s]; -inf: none came.
            predicted: where the robot is in the frame at a time.
            stepped: what it has moved between two times.
        """
        lidar, again = self._lidar, self._last is not None and stamp <= self._last[0]
        if stamp == -math.inf or again or len(lidar.submaps) == 0 or lidar.front.match is None or lidar.front.trouble:
            return None
        T_map_submap = lidar.submaps[lidar.current].T_map_submap
        T_map_base = T_map_submap @ lidar.front.T_local_base
        self._follow(stamp, T_map_submap, T_map_base, stepped)
        found = Place(stamp, T_map_base, from_body(to_body(lidar.front.covariance, lidar.front.T_local_base), T_map_base))
        self._last = stamp, T_map_base
        return found.moved(self.T_map_frame.inverse())

    def _follow(self, stamp: float, T_map_submap: SE2, T_map_base: SE2, stepped: Callable[[float, float], tuple[SE2, FloatArray]]) -> None:
        """Let the frame jump as the lidar's map does."""
        known, self._known = self._known, (self._lidar.current, T_map_submap)
        if known is None or self._last is None:
            return
        if known[0] == self._lidar.current:
            self.T_map_frame = T_map_submap @ known[1].inverse() @ self.T_map_frame
            return
        carried = self._last[1] @ stepped(self._last[0], stamp)[0]
        off = carried.inverse() @ T_map_base
        if max(abs(off.x), abs(off.y), abs(off.yaw)) > JUMP:
            self.T_map_frame = T_map_base @ carried.inverse() @ self.T_map_frame


def marker_place(visual: VisualSlamPipeline, since: float) -> Place | None:
    """The pose that the markers of the newest image alone give, in the marker map; None where they tell too little, or nothing new."""
    sight, graph = visual.sight, visual.graph
    if sight is None or graph is None or sight.stamp <= since:
        return None
    known = graph.known.known(sight.sightings)
    if not known:
        return None
    found = graph.known.locate(known, Prior(sight.T_map_base.as_array(), UNKNOWN))
    if not found.believable or not np.diag(found.covariance).max() < WEAKEST**2:
        return None
    return Place(sight.stamp, found.T_map_base, found.covariance)
