"""An office floor: a corridor with rooms on both sides, drawn at random."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from worlds.building import building
from worlds.errors import WorldOptionError
from worlds.floor_plan import Opening, Room
from worlds.world import World

WIDTHS, DEPTHS = (2.6, 4.6), (3.2, 4.6)
"""Of rooms, along the corridor and away from it [m]."""


@dataclass(frozen=True, slots=True)
class OfficeRandom:
    """A corridor with furnished rooms on both sides behind open doors; the robot reaches all of its free space."""

    length: float = 13.0
    """Of the corridor [m], 6 to 40."""
    corridor: float = 1.6
    """Width of the corridor [m], 1.2 to 4."""
    seed: int = 0

    def __post_init__(self) -> None:
        if not 6.0 <= self.length <= 40.0:
            raise WorldOptionError("office_random", "length", f"must be 6 to 40 m, got {self.length}")
        if not 1.2 <= self.corridor <= 4.0:
            raise WorldOptionError("office_random", "corridor", f"must be 1.2 to 4 m, got {self.corridor}")

    def build(self) -> World:
        """Make the floor."""
        random = np.random.default_rng(self.seed)
        rooms, openings = [Room(0.0, 0.0, self.length, self.corridor)], list[Opening]()
        for side in (1, -1):
            wall, depth = (self.corridor if side > 0 else 0.0), round(random.uniform(*DEPTHS), 2)
            ends = (wall, round(self.corridor + depth, 2)) if side > 0 else (-depth, wall)
            for x0, x1 in cut_rooms(self.length, random):
                kind = "meeting" if x1 - x0 > 4.0 else "office"
                rooms.append(Room(x0, ends[0], x1, ends[1], kind))
                openings.append(Opening((round(random.uniform(x0 + 0.75, x1 - 0.75), 2), wall), False, side=side))
        return building("office_random", f"{self.length:g} m corridor, {len(rooms) - 1} rooms, seed {self.seed}", rooms, openings, random)


def cut_rooms(length: float, random: np.random.Generator) -> list[tuple[float, float]]:
    """Spans that fill a length, each as wide as a room."""
    count = max(int(length / np.mean(WIDTHS)), 1)
    shares = random.uniform(WIDTHS[0], WIDTHS[1], count)
    inner: list[float] = (np.cumsum(shares)[:-1] / shares.sum() * length).round(2).tolist()
    return list(itertools.pairwise([0.0, *inner, length]))
