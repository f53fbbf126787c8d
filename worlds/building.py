"""A building from its rooms: walls, doors, furniture, start and tour."""

from __future__ import annotations

import numpy as np
from msgspec import structs

from worlds.floor_plan import Opening, Room, walls_of
from worlds.furnishing import furnish, parts_of, with_doors, without_pockets
from worlds.parts import Point
from worlds.touring import freest, with_tour
from worlds.world import World


def building(name: str, description: str, rooms: list[Room], openings: list[Opening], random: np.random.Generator) -> World:
    """A furnished building with open doors, all of whose free space the robot reaches; it starts in the first room.

    Furniture that shuts off a part of the free space is left out.
    """
    walls, doors = walls_of(rooms, openings), with_doors(openings)
    boxes, cylinders = parts_of(furnish(rooms, openings, walls, random))
    # the start is chosen last: an empty room has its middle free, a furnished one need not
    bare = World(name, walls, (*_doorstep(openings[0]), 0.0), description, boxes=boxes, cylinders=cylinders, doors=doors)
    whole, hall = without_pockets(bare), rooms[0]
    return with_tour(structs.replace(whole, start=(*freest(whole, (hall.x0, hall.y0, hall.x1, hall.y1)), 0.0)))


def _doorstep(opening: Opening) -> Point:
    """A place that is always free: the middle of a passage."""
    return opening.middle
