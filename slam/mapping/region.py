"""Which places a submap is the map of, and which scans it keeps for the polish."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slam.errors import require_positive
from slam.mapping.submap import Keyframe, Submap
from slam.motion.keyframes import KeyframeGate
from slam.scans import PointScan
from slam.se2 import SE2


@dataclass(frozen=True, slots=True)
class Region:
    """The places about a submap's origin, as far as the robot has gone through new ones: the memory is bounded by the area."""

    radius: float = 3.0
    """A submap is the map of the places within this distance of its origin [m]."""
    overlap: float = 1.0
    """So far before the border the next submap is begun [m]."""
    length: float = 5.0
    """Way through new places after which a submap takes in no more of them: its own drift is never corrected [m]."""
    near: float = 1.0
    """A full submap is the map of the places so near to the scans that it kept until then [m]."""
    kept: KeyframeGate = field(default_factory=lambda: KeyframeGate(0.1, 0.1))
    """Least distance between scans that are kept."""
    views: KeyframeGate = field(default_factory=lambda: KeyframeGate(0.3, 0.4))
    """The same in a full submap, where a scan only shows what is seen from there."""

    def __post_init__(self) -> None:
        require_positive(self, "radius", "overlap", "length", "near")

    def is_full(self, submap: Submap, margin: float = 0.0) -> bool:
        """Whether a submap takes in no more places, or will not after so much more way [m]."""
        return submap.travelled >= self.length - margin

    def covers(self, submap: Submap, T_submap_base: SE2, margin: float = 0.0) -> bool:
        """Whether a place lies in the submap's region, so far from its border [m]."""
        if math.hypot(T_submap_base.x, T_submap_base.y) > self.radius - margin:
            return False
        return not self.is_full(submap, margin) or submap.outside(T_submap_base) < self.near - 0.5 * margin

    def keep(self, submap: Submap, cloud: PointScan, T_submap_base: SE2) -> None:
        """Let the submap keep the scan where it has none from nearby."""
        full = self.is_full(submap)
        if submap.is_new(T_submap_base, self.views if full else self.kept):
            points, origins = cloud.points.astype(np.float32), cloud.origins.astype(np.float32)
            submap.keep(Keyframe(cloud.stamp, T_submap_base, points, origins, not full))
