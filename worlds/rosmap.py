"""Any map_server map as a world."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from slam.errors import MapFileError
from slam.grid import FREE, GridGeometry
from slam.map_file import read_map
from worlds.errors import WorldFileError, WorldOptionError
from worlds.map_area import SIGHT, distance, visible_area
from worlds.parts import FloatArray, Point, Wall
from worlds.raster import HALF_DIAGONAL, Mask, Raster
from worlds.rectangles import Rectangle, rectangles
from worlds.routes import Routes
from worlds.world import ROBOT_RADIUS, World

TOUR_CLEARANCE = 0.25
STOPS, REACH = 6, 15.0
"""Of the tour: how many far places it passes, and how far from the start they are at most [m]."""


@dataclass(frozen=True, slots=True)
class RosMap:
    """The area of a map where its origin lies, as the mapping robot began there; else the largest. What is not free is solid."""

    file: str
    """The map's YAML file."""
    height: float = 1.0
    """Of all walls [m], 0.4 to 10."""

    def __post_init__(self) -> None:
        if not 0.4 <= self.height <= 10.0:
            raise WorldOptionError("map", "height", f"must be 0.4 to 10 m, got {self.height}")

    def build(self) -> World:
        """Make the world, in the frame of the map; the robot starts where it has the most room.

        Raises:
            WorldFileError: the map cannot be read, or has no room for the robot.
        """
        picture = _read(Path(self.file))
        room = picture.room()
        walls = tuple(picture.wall(box, self.height) for box in rectangles(_rim(room)))
        half, clearance = 0.5 * picture.cell, (distance(room) - HALF_DIAGONAL) * picture.cell
        start, tour = _start_and_tour(Raster(picture.cell, (half, half), clearance))
        (x, y), *route = picture.points(np.array([start, *tour]))
        yaw = math.atan2(route[1][1] - y, route[1][0] - x) if route else 0.0
        description = f"{room.sum() * picture.cell**2:.0f} m^2 of a map"
        return World(Path(self.file).stem, walls, (x, y, round(yaw, 4)), description, tuple(route))


@dataclass(frozen=True, slots=True, eq=False)
class _Picture:
    """The part of a map in which there is something to see."""

    path: Path
    free: Mask
    corner: tuple[int, int]
    """Row and column of its first cell in the map."""
    geometry: GridGeometry

    @property
    def cell(self) -> float:
        """Side of a cell [m]."""
        return self.geometry.resolution

    def room(self) -> Mask:
        """The free cells that are the world."""
        home_row, home_col = self.geometry.to_cells(np.zeros((1, 2)))[0].tolist()
        room = visible_area(self.free, self.cell, (home_row - self.corner[0], home_col - self.corner[1]))
        if not room.any():
            raise WorldFileError(str(self.path), None, f"has no free place for a robot of radius {ROBOT_RADIUS} m")
        return room

    def points(self, places: FloatArray) -> list[Point]:
        """Points [m] in the map's frame of places (N, 2) [m] as x, y from the picture's lower left corner on."""
        moved = self.geometry.T_map_grid.transform(places + np.array(self.corner[::-1]) * self.cell)
        return [(x, y) for x, y in moved.round(6).tolist()]

    def wall(self, box: Rectangle, height: float) -> Wall:
        """The wall in a rectangle of cells, numbered from one before the picture's first, along its longer side."""
        y0, x0, y1, x1 = ((edge - 1) * self.cell for edge in box)
        level = x1 - x0 >= y1 - y0
        ends = [(x0, (y0 + y1) / 2), (x1, (y0 + y1) / 2)] if level else [((x0 + x1) / 2, y0), ((x0 + x1) / 2, y1)]
        begin, end = self.points(np.array(ends))
        return Wall(begin, end, round(min(x1 - x0, y1 - y0), 6), height)


def _read(path: Path) -> _Picture:
    try:
        grid = read_map(path)
    except MapFileError as error:
        raise WorldFileError(str(path), None, f"is no map: {error}") from error
    free = grid.states() == FREE
    edges = np.argwhere(free & ndimage.binary_dilation(~free)) if not free.all() else np.argwhere(free)
    if not len(edges):
        raise WorldFileError(str(path), None, "has no free cell")
    margin = math.ceil(SIGHT / grid.geometry.resolution)
    (row, col), (rows, cols) = np.maximum(edges.min(axis=0) - margin, 0).tolist(), (edges.max(axis=0) + margin + 1).tolist()
    return _Picture(path, free[row:rows, col:cols], (row, col), grid.geometry)


def _rim(room: Mask) -> NDArray[np.bool_]:
    """The cells round a room, in a picture that is one cell larger on all sides."""
    padded = np.pad(room, 1)
    return np.asarray(ndimage.binary_dilation(padded, np.ones((3, 3), np.bool_))) & ~padded


def _start_and_tour(raster: Raster) -> tuple[Point, list[Point]]:
    """The place with most room and a round trip from there, in the frame of the picture."""
    row, col = np.unravel_index(np.argmax(raster.clearance), raster.clearance.shape)
    x, y = raster.points(np.array([[row, col]]))[0].tolist()
    tour = Routes(raster, TOUR_CLEARANCE).round_trip((x, y), STOPS, REACH)
    return (tour[0], tour) if len(tour) > 1 else ((x, y), [])
