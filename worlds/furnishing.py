"""Furniture for the rooms of a floor plan, where there is room for it."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
from msgspec import structs
from scipy import ndimage

from worlds.floor_plan import THICKNESS, Opening, Room
from worlds.furniture import Part, Piece, bed, block, chair, drum, sofa, table
from worlds.living import Door
from worlds.parts import Box, Cylinder, FloatArray, Point, Wall
from worlds.placing import Surroundings
from worlds.raster import CERTIFICATE_CELL, Raster, pockets, rasterise
from worlds.world import ROBOT_RADIUS, World

Group = tuple[tuple[Piece, Point, float], ...]
"""Pieces that are put down together: each with its place [m] and turn [rad]; the group looks along x."""

TRIES = 30
WALL_GAP = 0.06
"""Between a wall and what stands at it [m]."""
PASSAGE = 0.9
"""Free floor on both sides of an opening [m]."""
CERTIFIED_RADII = tuple(ROBOT_RADIUS + margin for margin in (-0.02, -0.01, 0.0, 0.01, 0.02))
"""A robot of any of these radii reaches everything where it fits [m]: no passage is so narrow that rounding decides."""


def furnish(rooms: list[Room], openings: list[Opening], walls: tuple[Wall, ...], random: np.random.Generator) -> list[Piece]:
    """Pieces for every room after its kind, clear of each other and of the openings; what finds no place is left out."""
    keep_out = [_passage(opening) for opening in openings]
    placed: list[Piece] = []
    numbers: Counter[str] = Counter()
    for room in rooms:
        for group, at_wall in _groups(room.kind):
            parts = [part for piece in placed for part in piece.parts]
            pieces = _placed(group, room, at_wall, Surroundings((*walls, *keep_out, *parts)), random)
            for piece in pieces:
                name = piece.parts[0].name.split()[0]
                numbers[name] += 1
                placed.append(piece.placed((0.0, 0.0), 0.0, f"{name} {numbers[name]}"))
    return placed


def without_pockets(world: World) -> World:
    """The world without the furniture, and the doors, that shut the robot off from places where it would fit."""
    raster = rasterise(world, CERTIFICATE_CELL)
    shut = next((cells for cells in (pockets(raster, world.start[:2], radius) for radius in CERTIFIED_RADII) if cells[0].any()), None)
    if shut is None:
        return world
    between = ndimage.distance_transform_edt(~shut[0]) + ndimage.distance_transform_edt(~shut[1])
    things: list[Part | Door] = [*(part for part in (*world.boxes, *world.cylinders) if part.piece), *world.doors]
    return without_pockets(_without(world, min(things, key=lambda thing: _least(between, raster, thing.footprint()))))


def _least(field: FloatArray, raster: Raster, footprint: FloatArray) -> float:
    """Smallest value of a field of cells at the corners and the middle of a footprint."""
    rows, cols = raster.cells(np.vstack([footprint, footprint.mean(axis=0)])).T
    return float(field[rows, cols].min())


def _without(world: World, thing: Part | Door) -> World:
    """The world without a door, or without the piece that a part belongs to."""
    if isinstance(thing, Door):
        return structs.replace(world, doors=tuple(door for door in world.doors if door != thing))
    boxes = tuple(part for part in world.boxes if part.piece != thing.piece)
    cylinders = tuple(part for part in world.cylinders if part.piece != thing.piece)
    return structs.replace(world, boxes=boxes, cylinders=cylinders)


def parts_of(pieces: list[Piece]) -> tuple[tuple[Box, ...], tuple[Cylinder, ...]]:
    """Boxes and cylinders of all pieces, as a world takes them."""
    boxes = tuple(part for piece in pieces for part in piece.boxes)
    return boxes, tuple(part for piece in pieces for part in piece.cylinders)


def with_doors(openings: list[Opening]) -> tuple[Door, ...]:
    """An open door for every opening."""
    return tuple(opening.door("open") for opening in openings)


def _groups(kind: str) -> list[tuple[Group, bool]]:
    """What stands in a room, with whether it stands at a wall."""
    desk: Group = ((table(1.4, 0.7), (0.0, 0.0), math.pi / 2), (chair(), (0.55, 0.1), math.pi))
    shelf = _alone(block(0.35, 1.0, 1.8, "shelf"))
    groups: dict[str, list[tuple[Group, bool]]] = {
        "living": [(_alone(sofa()), True), (_dining(2), False), (shelf, True), (_alone(drum(0.18, 0.8, "plant")), True)],
        "bedroom": [(_alone(bed()), True), (_alone(block(0.6, 1.2, 2.0, "wardrobe")), True), (_alone(chair()), True)],
        "kitchen": [(_alone(block(0.6, 1.8, 0.9, "counter", "glossy")), True), (_dining(1), False), (_alone(drum(0.15, 0.4, "bin")), True)],
        "office": [(desk, True), (shelf, True), (_alone(drum(0.14, 0.35, "bin")), True), (desk, True)],
        "meeting": [(_dining(3), False), (_alone(block(0.45, 1.6, 0.8, "sideboard")), True), (_alone(drum(0.2, 0.9, "plant")), True)],
    }
    return groups.get(kind, [])


def _alone(piece: Piece) -> Group:
    return ((piece, (0.0, 0.0), 0.0),)


def _dining(chairs: int) -> Group:
    """A table with so many chairs on both of its long sides."""
    places = [(x - (chairs - 1) / 2) * 0.65 for x in range(chairs)]
    seats = [(chair(), (x, side * 0.6), -side * math.pi / 2) for x in places for side in (1, -1)]
    return ((table(0.65 * chairs + 0.35, 0.8), (0.0, 0.0), 0.0), *seats)


def _placed(group: Group, room: Room, at_wall: bool, surroundings: Surroundings, random: np.random.Generator) -> list[Piece]:
    for _ in range(TRIES):
        at, yaw = _at_wall(group, room, random) if at_wall else _inside(room, random)
        c, s = math.cos(yaw), math.sin(yaw)
        places = [(at[0] + c * x - s * y, at[1] + s * x + c * y) for _, (x, y), _ in group]
        pieces = [piece.placed(place, yaw + turn, "") for (piece, _, turn), place in zip(group, places, strict=True)]
        if all(surroundings.leave_room_for(piece) and _within(piece, room) for piece in pieces):
            return pieces
    return []


def _at_wall(group: Group, room: Room, random: np.random.Generator) -> tuple[Point, float]:
    """A place with the back to one of the walls."""
    piece, _, turn = group[0]
    back = -float(piece.placed((0.0, 0.0), turn, "").corners()[:, 0].min()) + THICKNESS / 2 + WALL_GAP
    x, y = random.uniform(room.x0, room.x1), random.uniform(room.y0, room.y1)
    places = [(room.x0 + back, y), (x, room.y0 + back), (room.x1 - back, y), (x, room.y1 - back)]
    side = int(random.integers(4))
    return places[side], side * math.pi / 2


def _inside(room: Room, random: np.random.Generator) -> tuple[Point, float]:
    across, up = random.uniform(0.35, 0.65), random.uniform(0.35, 0.65)
    at = room.x0 + across * (room.x1 - room.x0), room.y0 + up * (room.y1 - room.y0)
    return at, float(random.choice([0.0, math.pi / 2])) + random.uniform(-0.1, 0.1)


def _within(piece: Piece, room: Room) -> bool:
    (x0, y0), (x1, y1) = piece.corners().min(axis=0), piece.corners().max(axis=0)
    return bool(room.x0 < x0 and x1 < room.x1 and room.y0 < y0 and y1 < room.y1)


def _passage(opening: Opening) -> Box:
    size = (2 * PASSAGE, opening.width, 2.0) if opening.upright else (opening.width, 2 * PASSAGE, 2.0)
    return Box(opening.middle, size)
