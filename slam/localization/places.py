"""Whether the robot can be where it is said to be."""

from __future__ import annotations

import math

from slam.localization.known_map import KnownMap
from slam.se2 import SE2


def trouble_at(known_map: KnownMap, T_map_base: SE2) -> str:
    """What is wrong with a pose in a map; empty when nothing is. Cells that nobody has seen may be anything."""
    geometry = known_map.grid.geometry
    corner = known_map.field.T_grid_map @ T_map_base
    row, col = math.floor(corner.y / geometry.resolution), math.floor(corner.x / geometry.resolution)
    if not (0 <= row < geometry.height and 0 <= col < geometry.width):
        return "the pose lies outside the map"
    return "the pose lies in a wall" if known_map.grid.log_odds[row, col] > 0.0 else ""
