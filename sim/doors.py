"""A swinging door of the world as a body that the clock moves."""

from __future__ import annotations

import math

import numpy as np

from sim.figure import Part
from sim.scene import upright_prism
from slam.se2 import FloatArray
from worlds.living import Door

COLOUR = (156, 120, 84)
"""Red, green, blue, 0 to 255."""


class Leaf:
    """A door's leaf: where it is is a function of the door's clock."""

    def __init__(self, door: Door) -> None:
        self.door = door
        half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (door.width / 2, door.thickness / 2)
        self.parts = (Part(((upright_prism(half, door.height / 2), COLOUR),), door.material),)

    def frames(self, clocks: FloatArray) -> FloatArray:
        """T_world_leaf as rotation row by row and position, (1, K, 12), at clocks (K, 2): time [s] and its rate."""
        z = self.door.height / 2
        poses = [self.door.pose_at(t) for t in clocks[:, 0].tolist()]
        rows = [(math.cos(w), -math.sin(w), 0.0, math.sin(w), math.cos(w), 0.0, 0.0, 0.0, 1.0, x, y, z) for x, y, w in poses]
        return np.array([rows])

    def distances(self, clocks: FloatArray, x: float, y: float) -> FloatArray:
        """How far the leaf is from a place (K,) [m] at clocks (K, 2)."""
        ahead, aside = x - self.door.hinge[0], y - self.door.hinge[1]
        yaw = self.door.yaw + np.array([self.door.angle_at(t) for t in clocks[:, 0].tolist()])
        along = np.cos(yaw) * ahead + np.sin(yaw) * aside
        return np.hypot(along - np.clip(along, 0.0, self.door.width), np.cos(yaw) * aside - np.sin(yaw) * ahead)
