"""Pieces of furniture: parts about the origin that are placed, and moved, as one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from msgspec import structs

from worlds.parts import Box, Cylinder, FloatArray, Point

Part = Box | Cylinder


@dataclass(frozen=True, slots=True)
class Piece:
    """Parts that belong together."""

    parts: tuple[Part, ...]

    @property
    def boxes(self) -> tuple[Box, ...]:
        """Those of the parts that are boxes."""
        return tuple(part for part in self.parts if isinstance(part, Box))

    @property
    def cylinders(self) -> tuple[Cylinder, ...]:
        """Those of the parts that are cylinders."""
        return tuple(part for part in self.parts if isinstance(part, Cylinder))

    @property
    def middle(self) -> Point:
        """Mean of its parts' middles [m]."""
        x, y = np.mean([part.centre for part in self.parts], axis=0).tolist()
        return x, y

    def corners(self) -> FloatArray:
        """Corners of all parts' footprints (N, 2) [m]."""
        return np.vstack([part.footprint() for part in self.parts])

    def placed(self, at: Point, yaw: float, name: str) -> Piece:
        """The piece with its origin at a point and turned by `yaw` [rad], under a name of its own."""
        return Piece(tuple(structs.replace(part, piece=name) for part in self._turned((0.0, 0.0), at, yaw)))

    def moved(self, by: Point, yaw: float) -> Piece:
        """The piece turned by `yaw` [rad] about its middle and shifted."""
        x, y = self.middle
        return Piece(tuple(self._turned((x, y), (x + by[0], y + by[1]), yaw)))

    def _turned(self, about: Point, to: Point, yaw: float) -> list[Part]:
        c, s = math.cos(yaw), math.sin(yaw)
        parts: list[Part] = []
        for part in self.parts:
            u, v = part.centre[0] - about[0], part.centre[1] - about[1]
            centre = (round(to[0] + c * u - s * v, 4), round(to[1] + s * u + c * v, 4))
            turn = {"yaw": round(math.remainder(part.yaw + yaw, math.tau), 4)} if isinstance(part, Box) else {}
            parts.append(structs.replace(part, centre=centre, **turn))
        return parts


def table(length: float, width: float, leg: float = 0.025) -> Piece:
    """A table on four round legs, 0.74 m high."""
    legs = [Cylinder((x, y), leg, 0.7, name="table leg") for x, y in _corners(length / 2 - 0.08, width / 2 - 0.08)]
    return Piece((Box((0.0, 0.0), (length, width, 0.04), z=0.7, name="table top"), *legs))


def chair() -> Piece:
    """A chair on four legs that looks along x: its back is at negative x."""
    legs = [Cylinder((x, y), 0.018, 0.43, name="chair leg", material="dark") for x, y in _corners(0.21, 0.21)]
    seat = Box((0.0, 0.0), (0.46, 0.46, 0.04), z=0.43, name="seat")
    return Piece((seat, Box((-0.21, 0.0), (0.03, 0.42, 0.45), z=0.47, name="back"), *legs))


def block(length: float, width: float, height: float, name: str, material: str = "matte") -> Piece:
    """A cupboard, a shelf, a crate: a box that looks along x."""
    return Piece((structs.replace(Box((0.0, 0.0), (length, width, height), name=name), material=material),))


def drum(radius: float, height: float, name: str) -> Piece:
    """A bin, a flower pot: a cylinder."""
    return Piece((Cylinder((0.0, 0.0), radius, height, name=name),))


def sofa(width: float = 1.7) -> Piece:
    """A dark sofa that looks along x: its back is at negative x."""
    seat = Box((0.1, 0.0), (0.65, width, 0.42), name="sofa seat", material="dark")
    return Piece((seat, Box((-0.32, 0.0), (0.2, width, 0.8), name="sofa back", material="dark")))


def bed(width: float = 1.4) -> Piece:
    """A bed with its head at negative x."""
    return Piece((Box((0.05, 0.0), (1.95, width, 0.45), name="bed"), Box((-0.96, 0.0), (0.06, width, 0.9), name="bed head")))


def _corners(x: float, y: float) -> list[Point]:
    return [(x, y), (-x, y), (-x, -y), (x, -y)]
