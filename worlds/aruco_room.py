"""A square room with markers all round its walls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from msgspec import structs

from worlds.errors import WorldOptionError
from worlds.parts import Box, Cylinder, Marker, Point, Wall, WallTexture
from worlds.world import DICTIONARIES, World

MARKER_HEIGHTS = (0.3, 0.5, 0.2, 0.4, 0.6)
"""Heights of neighbouring markers' middles, in turn [m]."""
WALL_THICKNESS, WALL_HEIGHT = 0.1, 1.0
FURNITURE_ROOM = 5.0
"""Side of the room that the furniture and the tour were laid out in [m]; in another they move, not stretch."""
DICTIONARY = "DICT_ARUCO_MIP_36h12"


@dataclass(frozen=True, slots=True)
class ArucoRoom:
    """A square room with markers all round its walls and furniture that breaks its symmetry; the origin is its middle."""

    size: float = 5.0
    """Inner side of the room [m], 4 to 12."""
    spacing: float = 0.25
    """Distance from marker to marker along a wall [m]."""
    marker_size: float = 0.12
    """Side of a marker's black square [m], 0.02 to 0.3; a white margin of one of its modules (1/8) needs room too."""
    furniture: bool = True
    """Whether anything stands in the room."""
    markers: bool = True
    """Whether markers hang on the walls."""
    texture: WallTexture = "plaster"
    """What the camera sees on the walls."""

    def __post_init__(self) -> None:
        if not 4.0 <= self.size <= 12.0:
            raise WorldOptionError("aruco_room", "size", f"must be 4 to 12 m, got {self.size}")
        if not 0.02 <= self.marker_size <= 0.3:
            raise WorldOptionError("aruco_room", "marker_size", f"must be 0.02 to 0.3 m, got {self.marker_size}")
        if not 1.25 * self.marker_size <= self.spacing <= self.size:
            allowed = f"{1.25 * self.marker_size:.3f} m (marker and white margin) to {self.size} m"
            raise WorldOptionError("aruco_room", "spacing", f"must be {allowed}, got {self.spacing}")
        if 4 * self._markers_per_wall > DICTIONARIES[DICTIONARY]:
            problem = f"{self.spacing} m makes {4 * self._markers_per_wall} markers, {DICTIONARY} has {DICTIONARIES[DICTIONARY]}"
            raise WorldOptionError("aruco_room", "spacing", problem)

    @property
    def _markers_per_wall(self) -> int:
        return int(self.size / self.spacing + 1e-9)

    @property
    def _on_the_walls(self) -> str:
        return f"markers every {self.spacing:g} m round its walls" if self.markers else f"walls of {self.texture} without a marker"

    def build(self) -> World:
        """Make the room; the tour is a figure of eight through its middle."""
        scale = self.size / FURNITURE_ROOM
        tour = _figure_of_eight(1.75 * scale, 1.25 * scale)
        heading = math.atan2(tour[1][1] - tour[0][1], tour[1][0] - tour[0][0])
        return World(
            name="aruco_room",
            description=f"{self.size:g} x {self.size:g} m room, {self._on_the_walls}",
            walls=_room_walls(self.size, self.texture),
            start=(*tour[0], round(heading, 4)),
            tour=tour,
            dictionary=DICTIONARY,
            boxes=_boxes(scale) if self.furniture else (),
            cylinders=_cylinders(scale) if self.furniture else (),
            markers=self._markers() if self.markers else (),
        )

    def _markers(self) -> tuple[Marker, ...]:
        """Markers counter-clockwise round the room, from the wall in the east on, centred on each wall."""
        count = self._markers_per_wall
        along = (np.arange(count) - (count - 1) / 2) * self.spacing
        markers: list[Marker] = []
        for wall in range(4):
            c, s = round(math.cos(wall * math.pi / 2)), round(math.sin(wall * math.pi / 2))
            for offset in along.tolist():
                x, y = self.size / 2 * c - offset * s, self.size / 2 * s + offset * c
                z = MARKER_HEIGHTS[len(markers) % len(MARKER_HEIGHTS)]
                markers.append(Marker(len(markers), (round(x, 6), round(y, 6), z), math.atan2(-s, -c), self.marker_size))
        return tuple(markers)


def _figure_of_eight(half_length: float, half_width: float) -> tuple[Point, ...]:
    """Waypoints of Gerono's lemniscate, stretched: x = a cos t, y = b sin 2t, through the middle twice a round."""
    t = (np.arange(24) + 0.5) * (math.tau / 24) - math.pi / 2
    return tuple((round(half_length * math.cos(a), 3), round(half_width * math.sin(2 * a), 3)) for a in t)


def _room_walls(size: float, texture: WallTexture) -> tuple[Wall, ...]:
    """Four walls about the origin; two of them reach over the others' ends, so that the corners are closed."""
    axis, corner = (size + WALL_THICKNESS) / 2, size / 2 + WALL_THICKNESS
    lines = [
        ((axis, -size / 2), (axis, size / 2)),
        ((corner, axis), (-corner, axis)),
        ((-axis, size / 2), (-axis, -size / 2)),
        ((-corner, -axis), (corner, -axis)),
    ]
    return tuple(Wall(begin, end, WALL_THICKNESS, WALL_HEIGHT, texture=texture) for begin, end in lines)


def _boxes(scale: float) -> tuple[Box, ...]:
    placed = [
        Box((0.35, 1.75), (0.8, 0.35, 0.9), yaw=0.12, name="cupboard", piece="cupboard"),
        Box((-0.45, -1.7), (0.4, 0.4, 0.4), yaw=0.6, name="crate", piece="crate"),
        Box((-1.95, 1.95), (0.6, 0.25, 0.8), yaw=math.pi / 4, name="shelf"),
        Box((-1.0, 0.05), (0.54, 0.4, 0.03), yaw=0.25, z=0.7, name="table top", piece="table"),
        Box((2.0, 1.9), (0.3, 0.25, 0.3), yaw=-0.4, mass=1.0, name="parcel"),
    ]
    return tuple(structs.replace(box, centre=_moved(box.centre, scale), yaw=round(box.yaw, 4)) for box in placed)


def _cylinders(scale: float) -> tuple[Cylinder, ...]:
    column = Cylinder(_moved((1.05, -0.1), scale), radius=0.15, height=WALL_HEIGHT, name="column")
    (x, y), (c, s) = _moved((-1.0, 0.05), scale), (math.cos(0.25), math.sin(0.25))
    corners = [(0.22, 0.15), (-0.22, 0.15), (-0.22, -0.15), (0.22, -0.15)]
    feet = [(round(x + c * u - s * v, 4), round(y + s * u + c * v, 4)) for u, v in corners]
    return (column, *(Cylinder(foot, radius=0.025, height=0.7, name="table leg", piece="table") for foot in feet))


def _moved(point: Point, scale: float) -> Point:
    return round(point[0] * scale, 4), round(point[1] * scale, 4)
