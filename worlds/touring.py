"""A start and a tour for a world that has none of its own."""

from __future__ import annotations

import math

import numpy as np
from msgspec import structs

from worlds.parts import Point
from worlds.raster import components, rasterise
from worlds.routes import Routes
from worlds.world import World

CELL = 0.05
CLEARANCE = 0.25
"""What a tour keeps free [m]."""


def with_tour(world: World, stops: int = 6, reach: float = 15.0) -> World:
    """The world with a round trip from its start by places that lie far apart, within `reach` [m] of it.

    The start moves to the nearest place on the way, a few centimetres, and looks along it. Without any way the world stays as it is.
    """
    tour = Routes(rasterise(world, CELL), CLEARANCE).round_trip(world.start[:2], stops, reach)
    if len(tour) < 2:
        return world
    return structs.replace(world, tour=tuple(tour), start=looking(tour[0], tour[1]))


def looking(at: Point, to: Point) -> tuple[float, float, float]:
    """Start at a point with the heading to another one."""
    return (*at, round(math.atan2(to[1] - at[1], to[0] - at[0]), 4))


def freest(world: World, within: tuple[float, float, float, float]) -> Point:
    """Place with the most room around it of the largest area that a tour can cover; in a rectangle x0 y0 x1 y1 [m] if that is in it."""
    raster = rasterise(world, CELL)
    labels = components(raster.clearance >= CLEARANCE)
    room = np.where(labels == np.argmax(np.bincount(labels.ravel(), minlength=2)[1:]) + 1, raster.clearance, 0.0)
    (row0, col0), (row1, col1) = raster.cells(np.array(within).reshape(2, 2))
    inside = np.zeros_like(room)
    inside[row0:row1, col0:col1] = room[row0:row1, col0:col1]
    best = inside if inside.any() else room
    row, col = np.unravel_index(np.argmax(best), best.shape)
    x, y = raster.points(np.array([[row, col]]))[0].tolist()
    return x, y
