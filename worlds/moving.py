"""Furniture that stands elsewhere than when the world was mapped."""

from __future__ import annotations

import math

import numpy as np
from msgspec import structs

from worlds.furniture import Part, Piece
from worlds.parts import Box, Cylinder, FloatArray
from worlds.placing import Surroundings, keeps_clear
from worlds.world import World

FARTHEST, NEAREST, WIDEST_TURN = 0.5, 0.1, math.pi / 2
"""How far a piece goes at most and at least [m], and how wide it turns at most [rad]."""
WAY_CLEARANCE = 0.3
"""What it leaves to the robot's and people's ways [m]."""
TRIES = 100


def displaced(world: World, share: float, random: np.random.Generator, only: str = "") -> World:
    """The world with a share of its furniture elsewhere, free of overlap and off all ways; of pieces whose name begins with `only`.

    A piece that finds no other place stays, and another one goes instead.
    """
    parts: list[Part] = [*world.boxes, *world.cylinders]
    pieces = [indices for name, indices in _pieces(parts).items() if name.startswith(only)]
    left, ways = math.ceil(share * len(pieces) - 1e-9), _ways(world)
    for choice in random.permutation(len(pieces)):
        indices = pieces[int(choice)]
        rest = (*world.walls, *(part for i, part in enumerate(parts) if i not in indices))
        moved = _elsewhere(Piece(tuple(parts[i] for i in indices)), Surroundings(rest, world.doors), ways, random) if left else None
        if moved is not None:
            left -= 1
            for i, part in zip(indices, moved.parts, strict=True):
                parts[i] = part
    boxes = tuple(part for part in parts if isinstance(part, Box))
    return structs.replace(world, boxes=boxes, cylinders=tuple(part for part in parts if isinstance(part, Cylinder)))


def _pieces(parts: list[Part]) -> dict[str, list[int]]:
    """Numbers of the parts of whatever can be moved, by name: what belongs together, and what can be pushed."""
    pieces: dict[str, list[int]] = {}
    for i, part in enumerate(parts):
        if part.piece or part.mass > 0.0:
            pieces.setdefault(part.piece or f"{part.name} {i}", []).append(i)
    return pieces


def _ways(world: World) -> FloatArray:
    """Ways (N, 4) as x0 y0 x1 y1 [m] of the robot and of people."""
    start = world.start[:2]
    legs = [(start, world.tour[0] if world.tour else start), *world.legs(), *(leg for person in world.people for leg in person.legs())]
    return np.array([(*a, *b) for a, b in legs])


def _elsewhere(piece: Piece, surroundings: Surroundings, ways: FloatArray, random: np.random.Generator) -> Piece | None:
    """The piece in a free place near its own; None where no try has found one."""
    for _ in range(TRIES):
        heading, distance = random.uniform(-math.pi, math.pi), random.uniform(NEAREST, FARTHEST)
        shift = distance * math.cos(heading), distance * math.sin(heading)
        moved = piece.moved(shift, random.uniform(-WIDEST_TURN, WIDEST_TURN))
        if surroundings.leave_room_for(moved) and keeps_clear(moved, ways, WAY_CLEARANCE):
            return moved
    return None
