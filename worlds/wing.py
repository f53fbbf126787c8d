"""A wing of offices without doors: a corridor with rooms on both sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from worlds.flat import bare_building
from worlds.floor_plan import Opening, Room
from worlds.grounds import Ground
from worlds.office_random import cut_rooms
from worlds.world import World

CORRIDOR = (1.2, 2.0)
"""Width of the corridor [m]."""


@dataclass(frozen=True, slots=True)
class Wing(Ground):
    """A corridor along x with rooms to the north and the south, each with one gap for a door."""

    def build(self) -> World:
        """Make the wing; the robot starts in the corridor or in one of the rooms."""
        random = np.random.default_rng(self.seed)
        breadth = round(random.uniform(*CORRIDOR), 2)
        south = round((self.depth - breadth) * random.uniform(0.4, 0.6), 2)
        north = round(south + breadth, 2)
        rooms, openings = [Room(0.0, south, self.width, north)], list[Opening]()
        for wall, low, high in ((north, north, self.depth), (south, 0.0, south)):
            for x0, x1 in cut_rooms(self.width, random):
                rooms.append(Room(x0, low, x1, high))
                openings.append(Opening((round(random.uniform(x0 + 0.75, x1 - 0.75), 2), wall), False))
        return self.finished(bare_building("wing", rooms, openings, self.seed, random))
