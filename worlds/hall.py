"""The indoor hall of the documents: pillars, a counter, a glass front and waiting corners."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from worlds.floor_plan import HEIGHT, THICKNESS, Opening, Room, walls_of
from worlds.furnishing import parts_of
from worlds.furniture import Piece, block, chair, drum, sofa, table
from worlds.parts import Cylinder, Point, Poster, Wall
from worlds.touring import looking
from worlds.world import World

WIDTH, DEPTH = 12.0, 8.0
"""Between the centre lines of the walls [m]."""
GLASS = (3.5, 8.0)
"""Where the southern wall is of glass, along x [m]."""
CLOAKROOM = Room(6.2, DEPTH, 9.2, 10.4)
CLOAKROOM_DOOR = Opening((8.2, DEPTH), False, 0.9)
PILLARS: tuple[Point, ...] = ((3.4, 2.7), (8.5, 2.7), (3.4, 5.4), (8.5, 5.4))
ROUND = (4.3, 2.45)
"""Half axes of the tour about the middle of the hall [m]."""


@dataclass(frozen=True, slots=True)
class Hall:
    """A 12 x 8 m hall, more than the lidar's reach long, with a cloakroom behind a closed door."""

    def build(self) -> World:
        """Make the hall; the tour goes once round the pillars."""
        boxes, cylinders = parts_of(_furniture())
        pillars = tuple(Cylinder(at, 0.22, HEIGHT, name="pillar") for at in PILLARS)
        tour = _tour()
        return World(
            name="hall",
            walls=_walls(),
            start=looking(tour[0], tour[1]),
            description=f"{WIDTH:g} x {DEPTH:g} m hall, pillars, counter, glass front, cloakroom behind a closed door",
            tour=tour,
            boxes=boxes,
            cylinders=(*pillars, *cylinders),
            posters=_posters(),
            doors=(CLOAKROOM_DOOR.door("closed"),),
            floor="tiles",
        )


def _walls() -> tuple[Wall, ...]:
    """All walls, with a pane of glass in the southern one."""
    walls = list(walls_of([Room(0.0, 0.0, WIDTH, DEPTH), CLOAKROOM], [CLOAKROOM_DOOR]))
    south = next(wall for wall in walls if wall.begin[1] == wall.end[1] == 0.0)
    walls.remove(south)
    (left, _), (right, _) = south.begin, south.end
    panes = [Wall((GLASS[0], 0.0), (GLASS[1], 0.0), THICKNESS / 2, HEIGHT, "glass", "plain")]
    solid = [Wall((left, 0.0), (GLASS[0], 0.0), THICKNESS, HEIGHT), Wall((GLASS[1], 0.0), (right, 0.0), THICKNESS, HEIGHT)]
    return (*walls, *solid, *panes)


def _tour() -> tuple[Point, ...]:
    """Round the pillars, from the west."""
    angles = (np.arange(16) * (math.tau / 16) + math.pi).tolist()
    return tuple((round(6.0 + ROUND[0] * math.cos(a), 3), round(4.05 + ROUND[1] * math.sin(a), 3)) for a in angles)


def _furniture() -> list[Piece]:
    quarter = math.pi / 2
    return [
        block(0.6, 2.4, 1.1, "counter").placed((1.0, 6.4), 0.0, ""),
        block(0.6, 1.2, 1.1, "counter").placed((1.9, 7.3), -quarter, ""),
        block(0.8, 0.9, 1.9, "vending machine", "glossy").placed((11.4, 7.3), math.pi, "vending machine"),
        sofa().placed((11.4, 1.3), math.pi, "sofa 0"),
        sofa().placed((9.9, 0.5), quarter, "sofa 1"),
        table(0.8, 0.6).placed((10.4, 1.5), 0.1, "low table"),
        table(0.8, 0.8).placed((6.0, 4.1), 0.4, "table"),
        *(chair().placed((6.0 + 0.75 * math.cos(a), 4.1 + 0.75 * math.sin(a)), a + math.pi, f"chair {a:g}") for a in (0.4, 2.4, 4.6)),
        drum(0.22, 0.9, "plant").placed((0.5, 0.5), 0.0, "plant 0"),
        drum(0.22, 0.9, "plant").placed((5.2, 7.5), 0.0, "plant 1"),
        drum(0.16, 0.6, "bin").placed((10.5, 7.6), 0.0, "bin"),
        block(0.4, 1.8, 0.45, "bench").placed((0.45, 2.6), 0.0, "bench 0"),
        block(0.4, 1.8, 0.45, "bench").placed((3.9, 7.6), -quarter, "bench 1"),
        block(0.1, 0.8, 1.6, "stand").placed((2.2, 0.9), 1.1, "stand"),
        block(0.5, 1.6, 1.0, "rack").placed((6.6, 9.4), 0.0, "rack"),
    ]


def _posters() -> tuple[Poster, ...]:
    places = [(0.05, 4.6, 0.0), (11.95, 3.2, math.pi), (11.95, 5.4, math.pi), (5.6, 7.95, -math.pi / 2), (9.8, 7.95, -math.pi / 2)]
    return tuple(Poster((x, y, 1.4), round(yaw, 4), seed=10 + i) for i, (x, y, yaw) in enumerate(places))
