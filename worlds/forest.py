"""A forest of round pillars."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from worlds.floor_plan import HEIGHT
from worlds.grounds import Ground
from worlds.scattering import free_place, pillars, scatter
from worlds.world import World

DENSITY = 0.35
"""Pillars that are tried for each square metre."""
RADII = (0.08, 0.45)
"""[m]"""


@dataclass(frozen=True, slots=True)
class Forest(Ground):
    """A hall full of round pillars of all sizes."""

    def build(self) -> World:
        """Make the forest."""
        random, walls = np.random.default_rng(self.seed), self.outer_walls()
        radii = np.sort(random.uniform(*RADII, int(DENSITY * self.width * self.depth)))[::-1]
        discs = scatter(self.rectangle, walls, radii, random)
        start = (*free_place(self.rectangle, walls, discs, random), round(random.uniform(-3.1, 3.1), 3))
        description = f"{self.width:g} x {self.depth:g} m forest of {len(discs)} pillars, seed {self.seed}"
        return self.finished(World("forest", walls, start, description, cylinders=pillars(discs, HEIGHT)))
