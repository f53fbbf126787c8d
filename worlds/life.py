"""What has changed in a world since it was mapped, and what moves in it: options of every world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from worlds.errors import WorldOptionError
from worlds.living import SWING_TIME, Door, DoorState, Person
from worlds.moving import displaced
from worlds.parts import Point
from worlds.raster import rasterise
from worlds.routes import Routes
from worlds.world import World

Places = NDArray[np.int64]
"""Numbers of places in `Routes`."""

MOST_PEOPLE = 50
CELL = 0.05
TOUR_CLEARANCE = 0.25
"""What a way of the robot keeps free where a door has shut the one it had [m]."""
PERSON_CLEARANCE, PERSON_HEIGHT, PERSONAL_SPACE = 0.25, 2.0, 1.0
"""What people keep from everything below their height, and from where the robot starts [m]."""
MOVED, WALKING, SWINGING = range(3)
"""Every kind of change has a random stream of its own."""


@dataclass(frozen=True, slots=True)
class Life:
    """Changes to a world, the same ones for the same seed."""

    people: int = 0
    """How many walk about, on ways through free space."""
    moved: float = 0.0
    """Share of the furniture that stands up to 0.5 m and 90 deg away from where it was, 0 to 1."""
    doors: str = "kept"
    """`open`, `closed`, `ajar`, `swinging`, or `kept` as they are."""
    seed: int = 0

    def __post_init__(self) -> None:
        states = ("kept", *get_args(DoorState))
        checks = (
            ("people", 0 <= self.people <= MOST_PEOPLE, f"must be 0 to {MOST_PEOPLE}, got {self.people}"),
            ("moved", 0.0 <= self.moved <= 1.0, f"must be 0 to 1, got {self.moved}"),
            ("doors", self.doors in states, f"must be one of {', '.join(states)}, got '{self.doors}'"),
            ("seed", self.seed >= 0, f"must be 0 or above, got {self.seed}"),
        )
        for option, good, problem in checks:
            if not good:
                raise WorldOptionError("of any name", option, problem)

    def apply(self, world: World) -> World:
        """The world with its doors set, furniture moved and people walking; the tour leaves out what a door has shut.

        Raises:
            WorldOptionError: nobody can walk there.
        """
        if self.doors != "kept":
            world = _with_doors(world, self.doors, np.random.default_rng([self.seed, SWINGING]))
        if self.moved > 0.0:
            world = displaced(world, self.moved, np.random.default_rng([self.seed, MOVED]))
        if self.people > 0:
            world = _with_people(world, self.people, np.random.default_rng([self.seed, WALKING]))
        return world


def _with_doors(world: World, state: str, random: np.random.Generator) -> World:
    doors = tuple(_set(door, state, random) for door in world.doors)
    changed = structs.replace(world, doors=doors, tour=())
    ways = [*((world.start[:2], waypoint) for waypoint in world.tour[:1]), *world.legs()]
    if all(changed.clearance(a, b) >= TOUR_CLEARANCE for a, b in ways):
        return structs.replace(changed, tour=world.tour)
    return structs.replace(changed, tour=_remaining_tour(changed, world.tour))


def _set(door: Door, state: str, random: np.random.Generator) -> Door:
    delay, period = round(random.uniform(2.0, 10.0), 1), round(random.uniform(5.0, 12.0) * SWING_TIME, 1)
    return structs.replace(door, state=state, delay=delay, period=period)


def _remaining_tour(world: World, tour: tuple[Point, ...]) -> tuple[Point, ...]:
    """A round trip by those waypoints that can still be reached from the start."""
    raster = rasterise(world, CELL)
    routes, reachable = Routes(raster, TOUR_CLEARANCE), raster.connected(TOUR_CLEARANCE, world.start[:2])
    left = np.array(tour)[reachable[tuple(raster.cells(np.array(tour)).T)]]
    return tuple(routes.through([routes.nearest((x, y)) for x, y in left.tolist()]))


def _with_people(world: World, count: int, random: np.random.Generator) -> World:
    raster = rasterise(world, CELL, PERSON_HEIGHT)
    routes = Routes(raster, PERSON_CLEARANCE)
    if not len(routes.points):
        raise WorldOptionError(world.name, "people", "nobody can walk there: no place is wide enough")
    distances = np.linalg.norm(routes.points - np.array(world.start[:2]), axis=1)
    near = np.flatnonzero(np.isfinite(routes.lengths(int(np.argmin(distances)))))
    first = near[distances[near] >= PERSONAL_SPACE]
    people = tuple(_walker(routes, near, first if len(first) else near, random) for _ in range(count))
    return structs.replace(world, people=(*world.people, *people))


def _walker(routes: Routes, places: Places, first: Places, random: np.random.Generator) -> Person:
    """Somebody who walks round by three places, and stops at some corners on the way."""
    stops = [int(random.choice(first)), *random.choice(places, 2).tolist()]
    x, y = routes.points[stops[0]].tolist()
    path = routes.through(stops) or [(x, y)]
    pauses = np.where(random.random(len(path)) < 0.4, random.uniform(1.0, 4.0, len(path)), 0.0).round(1)
    height, speed = round(random.uniform(1.6, 1.9), 2), round(random.uniform(0.5, 1.2), 2)
    return Person(tuple(path), speed, tuple(pauses.tolist()), height, int(random.integers(2**31)))
