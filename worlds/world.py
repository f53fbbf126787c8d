"""A world: what stands in it, where the robot starts and which way it tours. Frozen and validated."""

from __future__ import annotations

import itertools
from functools import cached_property

import msgspec
import numpy as np
from msgspec import structs

from worlds import geometry
from worlds.complaints import complaint
from worlds.errors import WorldValueError
from worlds.living import PERSON_RADIUS, Door, Light, Person
from worlds.parts import Angle, Board, Box, Coordinate, Cylinder, FloatArray, FloorTexture, Marker, Point, Poster, Wall

Solid = Wall | Box | Cylinder

ROBOT_RADIUS = 0.13
"""Radius about `base` that start, waypoints and tour legs keep free [m]."""
ROBOT_HEIGHT = 0.35
"""What hangs higher does not stand in the robot's way [m]."""
DICTIONARIES = {
    "DICT_4X4_250": 250,
    "DICT_5X5_250": 250,
    "DICT_6X6_250": 250,
    "DICT_APRILTAG_36h11": 587,
    "DICT_ARUCO_MIP_36h12": 250,
}
"""OpenCV's name of a marker dictionary -> number of its ids."""


class World(msgspec.Struct, frozen=True, forbid_unknown_fields=True, dict=True):
    """A floor plan with heights. The map frame of the truth: x and y on the floor, z up [m].

    Raises:
        WorldValueError: a value is out of range, or the robot does not fit where it should start or drive.
    """

    name: str
    walls: tuple[Wall, ...] = msgspec.field(name="wall")
    start: tuple[Coordinate, Coordinate, Angle]
    """Pose of `base` at the start: x, y [m], yaw [rad]."""
    description: str = ""
    tour: tuple[Point, ...] = ()
    """Waypoints (x, y) [m] of a round trip: after the last one comes the first again."""
    dictionary: str = "DICT_ARUCO_MIP_36h12"
    """OpenCV's name of the dictionary that all markers are from."""
    boxes: tuple[Box, ...] = msgspec.field(name="box", default=())
    cylinders: tuple[Cylinder, ...] = msgspec.field(name="cylinder", default=())
    markers: tuple[Marker, ...] = msgspec.field(name="marker", default=())
    posters: tuple[Poster, ...] = msgspec.field(name="poster", default=())
    boards: tuple[Board, ...] = msgspec.field(name="board", default=())
    doors: tuple[Door, ...] = msgspec.field(name="door", default=())
    people: tuple[Person, ...] = msgspec.field(name="person", default=())
    light: Light = Light()
    floor: FloorTexture = "planks"
    """What the camera sees on the floor."""

    def __post_init__(self) -> None:
        _check_ranges(self)
        _check_walls(self)
        _check_markers(self)
        _check_ways(self)
        _check_people(self)
        _check_light(self)

    @property
    def solids(self) -> tuple[Solid, ...]:
        """Everything that stands in the world; what the clock moves, doors and people, is not among it."""
        return (*self.walls, *self.boxes, *self.cylinders)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Lowest x and y, highest x and y of everything solid [m]."""
        corners = np.vstack([solid.footprint() for solid in (*self.solids, *self.doors)])
        (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
        return float(x0), float(y0), float(x1), float(y1)

    def outlines(self, z: float, *, movable: bool = True) -> FloatArray:
        """Sides (N, 4) as x0 y0 x1 y1 [m] of everything solid at height `z` [m]; cylinders are polygons.

        Doors are as they are at time 0, people are left out. Movable bodies stand where they stood at the start, or are left out.
        """
        at_height = [solid for solid in (*self.solids, *self.doors) if solid.z_span[0] <= z < solid.z_span[1]]
        outlines = [geometry.sides(solid.footprint()) for solid in at_height if movable or solid.mass == 0.0]
        return np.vstack([np.empty((0, 4)), *outlines])

    def legs(self) -> list[tuple[Point, Point]]:
        """The tour's straight legs, the one back to the first waypoint last."""
        return list(zip(self.tour, (*self.tour[1:], *self.tour[:1]), strict=True)) if len(self.tour) > 1 else []

    def clearance(self, a: Point, b: Point) -> float:
        """Distance [m] between the straight way from `a` to `b` and the nearest solid, or door at time 0, in the robot's way."""
        return geometry.clearance(np.array(a), np.array(b), self._in_the_way)

    @cached_property
    def _in_the_way(self) -> geometry.Polygons:
        """Footprints of what the robot can bump into."""
        return geometry.Polygons([solid.footprint() for solid in (*self.solids, *self.doors) if solid.z_span[0] < ROBOT_HEIGHT])


def _check_ranges(world: World) -> None:
    # Decoding has checked a file already; a world made in Python has seen no check yet.
    content = msgspec.to_builtins(world)
    try:
        msgspec.convert(content, _RANGES)
    except msgspec.ValidationError as error:
        raise complaint(error, content, _RANGES) from error


def _check_walls(world: World) -> None:
    if not world.walls:
        raise WorldValueError("wall", [], "a world needs at least one wall")
    for i, wall in enumerate(world.walls):
        if wall.length < 1e-6:
            raise WorldValueError(f"wall[{i}].to", wall.end, "must differ from `from`: the wall has no length")


def _check_markers(world: World) -> None:
    capacity = DICTIONARIES.get(world.dictionary)
    if capacity is None:
        raise WorldValueError("dictionary", world.dictionary, f"must be one of {', '.join(DICTIONARIES)}")
    first: dict[int, int] = {}
    for i, marker in enumerate(world.markers):
        if marker.id >= capacity:
            raise WorldValueError(f"marker[{i}].id", marker.id, f"must be below {capacity}, the size of {world.dictionary}")
        if first.setdefault(marker.id, i) != i:
            raise WorldValueError(f"marker[{i}].id", marker.id, f"must be unique, marker[{first[marker.id]}] has it too")


def _check_ways(world: World) -> None:
    start = world.start[:2]
    _check_clear(world, "start", start, start)
    for i, waypoint in enumerate(world.tour):
        _check_clear(world, f"tour[{i}]", waypoint, waypoint)
    if world.tour:
        _check_clear(world, "tour[0]", start, world.tour[0])
    for i, (a, b) in enumerate(world.legs(), start=1):
        _check_clear(world, f"tour[{i % len(world.tour)}]", a, b)


def _check_people(world: World) -> None:
    obstacles = geometry.Polygons([solid.footprint() for solid in world.solids])
    for i, person in enumerate(world.people):
        for k, (a, b) in enumerate(person.legs() or [(person.path[0], person.path[0])], start=1):
            room = geometry.clearance(np.array(a), np.array(b), obstacles)
            if room < PERSON_RADIUS:
                key = f"person[{i}].path[{k % len(person.path)}]"
                raise WorldValueError(key, b, f"needs {PERSON_RADIUS} m of free space on the way from {list(a)}, has {room:.3f} m")


def _check_light(world: World) -> None:
    times = [time for time, _ in world.light.levels]
    if any(b <= a for a, b in itertools.pairwise(times)):
        raise WorldValueError("light.levels", world.light.levels, f"times must grow, they are {times}")


def _check_clear(world: World, key: str, a: Point, b: Point) -> None:
    room = world.clearance(a, b)
    if room < ROBOT_RADIUS:
        where = "" if a == b else f" on the way from {list(a)} to {list(b)}"
        raise WorldValueError(key, b, f"needs {ROBOT_RADIUS} m of free space{where}, has {room:.3f} m")


_RANGES = msgspec.defstruct("_RANGES", [(field.encode_name, field.type) for field in structs.fields(World)])
"""A world's fields and ranges without its other checks, which would never end."""
