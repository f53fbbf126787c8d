"""A cluttered hall: crates at all angles between a few free-standing walls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from worlds.floor_plan import HEIGHT, THICKNESS
from worlds.grounds import Ground
from worlds.parts import Point, Wall
from worlds.scattering import crates, free_place, scatter
from worlds.world import World

SCREEN = (0.7, 1.6)
"""Half lengths of the free-standing walls [m]."""
CRATE = (0.15, 0.7)
"""Radii of the circles round the crates [m]."""


@dataclass(frozen=True, slots=True)
class Clutter(Ground):
    """A hall with walls that stand free at any angle, and crates strewn between them."""

    def build(self) -> World:
        """Make the hall."""
        random, outer = np.random.default_rng(self.seed), self.outer_walls()
        area = self.width * self.depth
        middles = scatter(self.rectangle, outer, random.uniform(*SCREEN, max(int(area / 15.0), 1)), random)
        walls = (*outer, *(_screen((x, y), half, random.uniform(0.0, math.pi)) for x, y, half in middles.tolist()))
        discs = scatter(self.rectangle, walls, np.sort(random.uniform(*CRATE, int(0.3 * area)))[::-1], random)
        start = (*free_place(self.rectangle, walls, discs, random), round(random.uniform(-3.1, 3.1), 3))
        description = f"{self.width:g} x {self.depth:g} m hall, {len(discs)} crates, seed {self.seed}"
        return self.finished(World("clutter", walls, start, description, boxes=crates(discs, random)))


def _screen(middle: Point, half: float, yaw: float) -> Wall:
    """A free-standing wall about its middle."""
    dx, dy = half * math.cos(yaw), half * math.sin(yaw)
    (x, y) = middle
    return Wall((round(x - dx, 3), round(y - dy, 3)), (round(x + dx, 3), round(y + dy, 3)), THICKNESS, HEIGHT)
