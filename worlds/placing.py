"""Whether a piece of furniture has room where it is put."""

from __future__ import annotations

import numpy as np

from worlds import geometry
from worlds.furniture import Piece
from worlds.living import Door
from worlds.parts import FloatArray
from worlds.world import Solid

GAP = 0.03
"""Between pieces of furniture, and to walls [m]."""


class Surroundings:
    """What a piece must not touch: solids at its own height, doors on their whole way."""

    def __init__(self, solids: tuple[Solid, ...], doors: tuple[Door, ...] = ()) -> None:
        self._shapes = [(solid.footprint(), solid.z_span) for solid in solids]
        self._shapes += [(_sweep(door), door.z_span) for door in doors]
        centres = [shape.mean(axis=0) for shape, _ in self._shapes]
        self._centres = np.array(centres).reshape(-1, 2)
        self._reaches = np.array([np.linalg.norm(shape - c, axis=1).max() for (shape, _), c in zip(self._shapes, centres, strict=True)])

    def leave_room_for(self, piece: Piece) -> bool:
        """Whether no part of the piece touches anything."""
        return all(self._leave_room(part.footprint(), part.z_span) for part in piece.parts)

    def _leave_room(self, footprint: FloatArray, z_span: tuple[float, float]) -> bool:
        middle = footprint.mean(axis=0)
        reach = np.linalg.norm(footprint - middle, axis=1).max() + GAP
        near = np.flatnonzero(np.linalg.norm(self._centres - middle, axis=1) < self._reaches + reach)
        others = [self._shapes[i] for i in near.tolist()]
        return all(geometry.apart(footprint, shape, GAP) for shape, (low, high) in others if low < z_span[1] and z_span[0] < high)


def keeps_clear(piece: Piece, ways: FloatArray, room: float) -> bool:
    """Whether the piece leaves `room` [m] to both sides of straight ways (N, 4) as x0 y0 x1 y1 [m]."""
    corners, middle = piece.corners(), np.array(piece.middle)
    reach = float(np.linalg.norm(corners - middle, axis=1).max())
    distances = geometry.point_distances(np.broadcast_to(middle, (len(ways), 2)), ways[:, :2], ways[:, 2:])
    obstacles = geometry.Polygons([part.footprint() for part in piece.parts])
    return all(geometry.clearance(way[:2], way[2:], obstacles) >= room for way in ways[distances < room + reach])


def _sweep(door: Door) -> FloatArray:
    """Polygon (5, 2) round the way of a door's free edge, a quarter turn at most."""
    yaws = np.linspace(door.yaw, door.yaw + door.opening, 4)
    yaws = yaws if door.opening > 0.0 else yaws[::-1]
    edge = np.array(door.hinge) + 1.05 * door.width * np.column_stack([np.cos(yaws), np.sin(yaws)])
    return np.vstack([np.array([door.hinge]), edge])
