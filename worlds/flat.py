"""A flat without doors: rooms split at random, with crates in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worlds.apartment import connected_rooms, split_rooms
from worlds.floor_plan import Opening, Room, walls_of
from worlds.grounds import Ground
from worlds.parts import Box, FloatArray
from worlds.scattering import crates, free_place, scatter
from worlds.world import World

CRATES = 2
"""That are tried in every room."""
RADII = (0.2, 0.5)
"""Of the circles round them [m]."""


@dataclass(frozen=True, slots=True)
class Flat(Ground):
    """Rooms with gaps for doors, and a few crates."""

    def build(self) -> World:
        """Make the flat; the robot starts in one of the rooms."""
        random = np.random.default_rng(self.seed)
        rooms = split_rooms(Room(*self.rectangle), random)
        return self.finished(bare_building("flat", rooms, connected_rooms(rooms, random), self.seed, random))


def bare_building(name: str, rooms: list[Room], openings: list[Opening], seed: int, random: np.random.Generator) -> World:
    """Rooms without doors; crates stand clear of walls and of the gaps."""
    walls = walls_of(rooms, openings)
    gaps = np.array([opening.middle for opening in openings]).reshape(-1, 2)
    discs, boxes = np.empty((0, 3)), list[Box]()
    for room in rooms:
        strewn = scatter((room.x0, room.y0, room.x1, room.y1), walls, random.uniform(*RADII, CRATES), random)
        strewn = strewn[_clear_of(strewn, gaps)]
        boxes += crates(strewn, random)
        discs = np.vstack([discs, strewn])
    room = rooms[int(random.integers(len(rooms)))]
    start = (*free_place((room.x0, room.y0, room.x1, room.y1), walls, discs, random), round(random.uniform(-3.1, 3.1), 3))
    return World(name, walls, start, f"{len(rooms)} rooms, seed {seed}", boxes=tuple(boxes))


def _clear_of(discs: FloatArray, gaps: FloatArray) -> NDArray[np.bool_]:
    """Which discs (K, 3) leave every gap free, (K,)."""
    apart = np.linalg.norm(discs[:, None, :2] - gaps, axis=2) - discs[:, 2:]
    return np.all(apart >= 0.9, axis=1)
