"""What stands in a world: walls, boxes, cylinders, markers, posters, boards. Frozen; ranges are checked when a `World` is made of them."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Coordinate = Annotated[float, Meta(ge=-1000.0, le=1000.0)]
Length = Annotated[float, Meta(gt=0.0, le=1000.0)]
Height = Annotated[float, Meta(ge=0.0, le=1000.0)]
Mass = Annotated[float, Meta(ge=0.0, le=1000.0)]
Angle = Annotated[float, Meta(ge=-6.2832, le=6.2832)]
Point = tuple[Coordinate, Coordinate]
Material = Literal["matte", "dark", "glossy", "glass"]
"""What the lidar and the camera make of a surface: it scatters, swallows, mirrors or lets through what falls on it."""
FloorTexture = Literal["plain", "planks", "tiles", "carpet", "concrete"]
WallTexture = Literal["plain", "plaster", "brick", "rock", "panels"]

CYLINDER_SIDES = 48
"""Sides of the polygon that stands for a circle: 0.2 % of the radius at most."""


class Wall(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An upright wall on the floor, `thickness / 2` to either side of its centre line."""

    begin: Point = msgspec.field(name="from")
    """First end of the centre line (x, y) [m]."""
    end: Point = msgspec.field(name="to")
    """Other end of the centre line (x, y) [m]."""
    thickness: Length = 0.1
    height: Length = 1.0
    material: Material = "matte"
    texture: WallTexture = "plaster"
    """What the camera sees on it."""

    @property
    def z_span(self) -> tuple[float, float]:
        """Lowest and highest z [m]."""
        return 0.0, self.height

    @property
    def mass(self) -> float:
        """A wall never moves."""
        return 0.0

    @property
    def length(self) -> float:
        """Length of the centre line [m]."""
        return math.dist(self.begin, self.end)

    @property
    def yaw(self) -> float:
        """Direction from the first end to the other [rad]."""
        return math.atan2(self.end[1] - self.begin[1], self.end[0] - self.begin[0])

    @property
    def centre(self) -> tuple[float, float]:
        """Middle of the centre line (x, y) [m]."""
        return (self.begin[0] + self.end[0]) / 2, (self.begin[1] + self.end[1]) / 2

    def footprint(self) -> FloatArray:
        """Corners (4, 2) [m], counter-clockwise."""
        return rectangle(self.centre, (self.length, self.thickness), self.yaw)


class Box(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An upright box: furniture."""

    centre: Point
    """Middle of its floor area (x, y) [m]."""
    size: tuple[Length, Length, Length]
    """Along its own x, y and z [m]."""
    yaw: Angle = 0.0
    z: Height = 0.0
    """Height of its lower side [m]."""
    mass: Mass = 0.0
    """0: fixed; above: a movable body of that mass [kg]."""
    name: str = "box"
    piece: str = ""
    """Piece of furniture that it is a part of, which is moved as one; empty: it stays where it is."""
    material: Material = "matte"

    @property
    def z_span(self) -> tuple[float, float]:
        """Lowest and highest z [m]."""
        return self.z, self.z + self.size[2]

    def footprint(self) -> FloatArray:
        """Corners (4, 2) [m], counter-clockwise."""
        return rectangle(self.centre, self.size[:2], self.yaw)


class Cylinder(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An upright cylinder: a column, a table leg, a bin."""

    centre: Point
    """(x, y) [m]"""
    radius: Length
    height: Length
    z: Height = 0.0
    """Height of its lower side [m]."""
    mass: Mass = 0.0
    """0: fixed; above: a movable body of that mass [kg]."""
    name: str = "cylinder"
    piece: str = ""
    """Piece of furniture that it is a part of, which is moved as one; empty: it stays where it is."""
    material: Material = "matte"

    @property
    def z_span(self) -> tuple[float, float]:
        """Lowest and highest z [m]."""
        return self.z, self.z + self.height

    def footprint(self) -> FloatArray:
        """Corners (48, 2) [m] on the circle, counter-clockwise."""
        angles = np.arange(CYLINDER_SIDES) * (math.tau / CYLINDER_SIDES)
        return np.array(self.centre) + self.radius * np.column_stack([np.cos(angles), np.sin(angles)])


class Marker(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A printed square marker, upright and flat on a surface. Its frame: x to the right, y up, z out of the print."""

    id: Annotated[int, Meta(ge=0)]
    position: tuple[Coordinate, Coordinate, Height]
    """Its middle (x, y, z) [m]."""
    yaw: Angle
    """Direction in which it looks: heading of its outward normal [rad]."""
    size: Length = 0.12
    """Side of the black square, without the white margin [m]."""

    def corners(self) -> FloatArray:
        """Corners of the black square (4, 3) [m]: top left, top right, bottom right, bottom left as seen from the front."""
        return _print_corners(self.position, self.yaw, (self.size, self.size))


class Poster(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A printed picture, upright and flat on a surface. Its frame is as a marker's."""

    position: tuple[Coordinate, Coordinate, Height]
    """Its middle (x, y, z) [m]."""
    yaw: Angle
    """Direction in which it looks: heading of its outward normal [rad]."""
    size: tuple[Length, Length] = (0.6, 0.8)
    """Width and height [m]."""
    seed: Annotated[int, Meta(ge=0)] = 0
    """Of what is printed on it."""

    def corners(self) -> FloatArray:
        """Corners (4, 3) [m]: top left, top right, bottom right, bottom left as seen from the front."""
        return _print_corners(self.position, self.yaw, self.size)


class Board(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A ChArUco board to calibrate a camera by, that only the camera sees. Its frame is as a marker's, tilted."""

    position: tuple[Coordinate, Coordinate, Height]
    """Its middle (x, y, z) [m]."""
    yaw: Angle
    """Direction in which it looks: heading of its outward normal [rad]."""
    tilt: Annotated[float, Meta(ge=-1.2, le=1.2)] = 0.0
    """How far it looks up [rad]."""
    columns: Annotated[int, Meta(ge=3, le=20)] = 5
    """Squares across."""
    rows: Annotated[int, Meta(ge=3, le=20)] = 7
    """Squares down."""
    square: Length = 0.1
    """Side of a square [m]; that of a marker in it is three quarters of it."""
    dictionary: Literal["DICT_4X4_250", "DICT_5X5_250", "DICT_6X6_250"] = "DICT_6X6_250"
    """Of its markers."""
    first: Annotated[int, Meta(ge=0, le=200)] = 0
    """Id of its first marker."""

    def corners(self) -> FloatArray:
        """Corners of the squares (4, 3) [m]: top left, top right, bottom right, bottom left as seen from the front."""
        upright = _print_corners((0.0, 0.0, 0.0), 0.0, (self.columns * self.square, self.rows * self.square))
        (ct, st), (c, s) = (math.cos(self.tilt), math.sin(self.tilt)), (math.cos(self.yaw), math.sin(self.yaw))
        tilted = upright @ np.array([[ct, 0.0, st], [0.0, 1.0, 0.0], [-st, 0.0, ct]])
        return np.array(self.position) + tilted @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def _print_corners(position: tuple[float, float, float], yaw: float, size: tuple[float, float]) -> FloatArray:
    right = np.array([-math.sin(yaw), math.cos(yaw), 0.0]) * size[0] / 2
    up = np.array([0.0, 0.0, 1.0]) * size[1] / 2
    return np.array(position) + np.array([up - right, up + right, right - up, -right - up])


def rectangle(centre: tuple[float, float], size: tuple[float, float], yaw: float) -> FloatArray:
    """Corners (4, 2), counter-clockwise, of a rectangle turned by `yaw` [rad] about its middle."""
    half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array(size) / 2
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array(centre) + half @ np.array([[c, s], [-s, c]])
