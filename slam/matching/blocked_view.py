"""Whether a scan that fits no surface speaks against a pose."""

from __future__ import annotations

from slam.kernels.sight import pierced
from slam.matching.surface_field import SurfaceField
from slam.scans import PointScan
from slam.se2 import SE2

SEEN_THROUGH = 0.05
"""Share of a scan's beams from which on they cannot all pass known walls by noise: the pose is wrong."""


def blocked(cloud: PointScan, surfaces: SurfaceField, T_map_base: SE2) -> bool:
    """Whether a scan that fits no surface is no argument against its pose: what is new stands in front, and no wall is seen through."""
    T_grid_base = surfaces.pose_in_grid(T_map_base)
    through = pierced(T_grid_base.transform(cloud.origins), T_grid_base.transform(cloud.points), surfaces.arrays)
    return float(through.mean()) < SEEN_THROUGH if len(through) else True
