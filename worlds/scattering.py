"""Things strewn over a floor so far apart that a robot passes between any two of them."""

from __future__ import annotations

import math

import numpy as np

from worlds.geometry import point_distances
from worlds.parts import Box, Cylinder, FloatArray, Point, Wall

GAP = 0.6
"""Between two things, and to walls [m]."""
TRIES = 12
"""Places that are tried for each thing."""
HEIGHTS = (0.4, 1.6)
"""[m]"""


def scatter(
    rectangle: tuple[float, float, float, float], walls: tuple[Wall, ...], wanted: FloatArray, random: np.random.Generator
) -> FloatArray:
    """Discs (K, 3) as x, y and radius [m] of those that found a place, `GAP` clear of walls and of each other.

    Args:
        rectangle: x0 y0 x1 y1 [m] of their middles.
        walls: what they keep away from.
        wanted: (N,) their radii [m].
        random: draws their places.
    """
    x0, y0, x1, y1 = rectangle
    begins, ends = np.array([wall.begin for wall in walls]), np.array([wall.end for wall in walls])
    thick = 0.5 * np.array([wall.thickness for wall in walls])
    discs = np.empty((0, 3))
    for radius in wanted.tolist():
        places = random.uniform((x0, y0), (x1, y1), (TRIES, 2))
        for place in places:
            apart = np.hypot(*(discs[:, :2] - place).T) - discs[:, 2] - radius
            room = point_distances(np.broadcast_to(place, begins.shape), begins, ends) - thick - radius
            if min(apart.min(initial=np.inf), room.min()) >= GAP:
                discs = np.vstack([discs, [*place, radius]])
                break
    return discs.round(3)


def crates(discs: FloatArray, random: np.random.Generator, *, askew: bool = True) -> tuple[Box, ...]:
    """A box in each disc (N, 3), its corners on the circle or little within."""
    boxes: list[Box] = []
    for x, y, radius in discs.tolist():
        slant, yaw, height = random.uniform(0.35, 1.2), random.uniform(0.0, math.pi) if askew else 0.0, random.uniform(*HEIGHTS)
        size = (round(1.98 * radius * math.cos(slant), 3), round(1.98 * radius * math.sin(slant), 3), round(height, 2))
        boxes.append(Box((x, y), size, round(yaw, 3), name="crate"))
    return tuple(boxes)


def pillars(discs: FloatArray, height: float) -> tuple[Cylinder, ...]:
    """A cylinder for each disc (N, 3)."""
    return tuple(Cylinder((x, y), radius, height, name="pillar") for x, y, radius in discs.tolist())


def free_place(
    rectangle: tuple[float, float, float, float], walls: tuple[Wall, ...], discs: FloatArray, random: np.random.Generator
) -> Point:
    """A place in a rectangle where a robot stands with room, by chance; things (N, 3) that were scattered are kept clear of."""
    for _ in range(1000):
        x, y = random.uniform(rectangle[:2], rectangle[2:]).round(3).tolist()
        apart = np.hypot(discs[:, 0] - x, discs[:, 1] - y) - discs[:, 2]
        begins, ends = np.array([wall.begin for wall in walls]), np.array([wall.end for wall in walls])
        room = point_distances(np.broadcast_to(np.array([x, y]), begins.shape), begins, ends)
        if min(apart.min(initial=np.inf), room.min()) >= 0.5 * GAP:
            return x, y
    return 0.5 * (rectangle[0] + rectangle[2]), 0.5 * (rectangle[1] + rectangle[3])
