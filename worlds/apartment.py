"""A flat: a rectangle split into rooms at random."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from worlds.building import building
from worlds.errors import WorldOptionError
from worlds.floor_plan import Opening, Room
from worlds.parts import Point
from worlds.world import World

SMALLEST_SIDE = 2.4
"""Of a room [m]."""
LARGEST_AREA = 16.0
"""Of a room that is not split any more [m^2]."""
JAMB = 0.75
"""From the middle of a door to the nearest corner at least [m]."""
DRAWS = 5
"""Places for a door of which the one farthest from other doors is taken."""
SECOND_DOORS = 0.3
"""Share of the walls between rooms that have a door without need."""
KINDS = ("living", "kitchen", "bedroom", "office")
"""Of rooms, from the largest down and over again."""


@dataclass(frozen=True, slots=True)
class Apartment:
    """Rooms behind open doors, furnished; every seed makes another flat, and the robot reaches all of its free space."""

    width: float = 9.0
    """Along x [m], 6 to 16."""
    depth: float = 7.0
    """Along y [m], 6 to 16."""
    seed: int = 0

    def __post_init__(self) -> None:
        for option, value in (("width", self.width), ("depth", self.depth)):
            if not 6.0 <= value <= 16.0:
                raise WorldOptionError("apartment", option, f"must be 6 to 16 m, got {value}")

    def build(self) -> World:
        """Make the flat."""
        random = np.random.default_rng(self.seed)
        rooms = sorted(split_rooms(Room(0.0, 0.0, self.width, self.depth), random), key=lambda room: -room.area)
        kinds = [KINDS[i % len(KINDS)] for i in range(len(rooms))]
        rooms = [Room(room.x0, room.y0, room.x1, room.y1, kind) for room, kind in zip(rooms, kinds, strict=True)]
        description = f"{self.width:g} x {self.depth:g} m flat, {len(rooms)} rooms, seed {self.seed}"
        return building("apartment", description, rooms, connected_rooms(rooms, random), random)


def split_rooms(room: Room, random: np.random.Generator) -> list[Room]:
    """Rooms that fill a rectangle."""
    upright = room.x1 - room.x0 >= room.y1 - room.y0
    low, high = (room.x0, room.x1) if upright else (room.y0, room.y1)
    if room.area <= LARGEST_AREA or high - low < 2 * SMALLEST_SIDE:
        return [room]
    at = round(random.uniform(low + SMALLEST_SIDE, high - SMALLEST_SIDE), 2)
    first = Room(room.x0, room.y0, at, room.y1) if upright else Room(room.x0, room.y0, room.x1, at)
    second = Room(at, room.y0, room.x1, room.y1) if upright else Room(room.x0, at, room.x1, room.y1)
    return [*split_rooms(first, random), *split_rooms(second, random)]


def connected_rooms(rooms: list[Room], random: np.random.Generator) -> list[Opening]:
    """Doors that join all rooms, and some more."""
    pairs = [(i, k) for i in range(len(rooms)) for k in range(i)]
    group = list(range(len(rooms)))
    openings: list[Opening] = []
    for choice in random.permutation(len(pairs)):
        i, k = pairs[int(choice)]
        opening = _between(rooms[i], rooms[k], openings, random)
        if opening is not None and (group[i] != group[k] or random.random() < SECOND_DOORS):
            openings.append(opening)
            group = [group[i] if other == group[k] else other for other in group]
    return openings


def _between(a: Room, b: Room, others: list[Opening], random: np.random.Generator) -> Opening | None:
    """A door in the wall that two rooms share, as far from the other doors as luck has it; None where the wall is too short."""
    low, high = max(a.y0, b.y0) + JAMB, min(a.y1, b.y1) - JAMB
    for x in {a.x0, a.x1} & {b.x0, b.x1}:
        if low < high:
            return _farthest([(x, y) for y in random.uniform(low, high, DRAWS).round(2).tolist()], True, others, random)
    low, high = max(a.x0, b.x0) + JAMB, min(a.x1, b.x1) - JAMB
    for y in {a.y0, a.y1} & {b.y0, b.y1}:
        if low < high:
            return _farthest([(x, y) for x in random.uniform(low, high, DRAWS).round(2).tolist()], False, others, random)
    return None


def _farthest(places: list[Point], upright: bool, others: list[Opening], random: np.random.Generator) -> Opening:
    place = max(places, key=lambda place: min((math.dist(place, other.middle) for other in others), default=0.0))
    side, end = (1 if draw else -1 for draw in (random.random(2) < 0.5).tolist())
    return Opening(place, upright, side=side, end=end)
