"""The office of the documents: a corridor, a meeting room, a cluttered area A and three rooms that are shut at first."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from msgspec import structs

from worlds.floor_plan import Opening, Room, walls_of
from worlds.furnishing import parts_of
from worlds.furniture import Piece, block, chair, drum, table
from worlds.moving import displaced
from worlds.parts import Point, Poster
from worlds.placing import Surroundings, keeps_clear
from worlds.touring import looking
from worlds.world import World

AREA_A = Room(8.6, 1.7, 14.0, 6.6)
ROOMS = [
    Room(0.0, 0.0, 14.0, 1.7),
    Room(0.0, 1.7, 6.4, 6.6),
    Room(6.4, 1.7, 8.6, 6.6),
    AREA_A,
    Room(0.0, -3.8, 7.0, 0.0),
    Room(7.0, -3.8, 14.0, 0.0),
]
MEETING_DOOR = Opening((5.2, 1.7), False, 1.0, end=1)
OTHER_DOORS = [Opening((7.5, 1.7), False, 0.9), Opening((3.0, 0.0), False, 0.9, -1), Opening((10.5, 0.0), False, 0.9, -1)]
AREA_A_GAP = Opening((9.8, 1.7), False, 1.4)
TOUR: tuple[Point, ...] = (
    (0.8, 0.85),
    (5.2, 0.85),
    (5.2, 2.7),
    (5.5, 5.9),
    (0.75, 5.9),
    (0.75, 2.65),
    (4.9, 2.65),
    (5.2, 0.95),
    (9.8, 0.85),
    (9.9, 2.6),
    (9.3, 4.2),
    (10.3, 5.7),
    (12.1, 5.5),
    (12.9, 3.8),
    (11.5, 2.9),
    (9.7, 2.4),
    (9.8, 0.95),
    (13.2, 0.85),
)
CLUTTER_CLEARANCE = 0.35
"""What the clutter of area A leaves to the tour [m]."""
CLUTTER_SEED, DISPLACED_SEED = 11, 12


@dataclass(frozen=True, slots=True)
class Office:
    """A 14 x 10 m floor; its tour is a fixed one, from the corridor round the meeting room and through area A."""

    displaced: bool = False
    """Whether all clutter of area A stands elsewhere than when the map was made."""

    def build(self) -> World:
        """Make the office; the meeting room is open, the other doors are closed."""
        openings = [MEETING_DOOR, AREA_A_GAP, *OTHER_DOORS]
        walls = walls_of(ROOMS, openings)
        doors = (MEETING_DOOR.door("open"), *(opening.door("closed") for opening in OTHER_DOORS))
        world = World(
            name="office",
            walls=walls,
            start=looking(TOUR[0], TOUR[1]),
            description="14 m corridor, meeting room, cluttered area A, three rooms behind closed doors",
            tour=TOUR,
            posters=_posters(),
            doors=doors,
            floor="carpet",
        )
        boxes, cylinders = parts_of([*_meeting_room(), *_shut_rooms(), *_clutter(world)])
        furnished = structs.replace(world, boxes=boxes, cylinders=cylinders)
        return displaced(furnished, 1.0, np.random.default_rng(DISPLACED_SEED), "clutter") if self.displaced else furnished


def _meeting_room() -> list[Piece]:
    seats = [((x, y), math.copysign(math.pi / 2, 4.1 - y)) for x in (1.9, 2.7, 3.5) for y in (3.35, 4.85)]
    chairs = [chair().placed(at, yaw, f"chair {i}") for i, (at, yaw) in enumerate(seats)]
    board = block(0.4, 1.6, 0.8, "sideboard").placed((2.7, 2.0), math.pi / 2, "sideboard")
    return [table(2.6, 1.1, 0.03).placed((2.7, 4.1), 0.0, "meeting table"), board, *chairs]


def _shut_rooms() -> list[Piece]:
    """A desk, its chair and a shelf in each of the rooms behind closed doors."""
    spots = [((7.5, 5.9), -math.pi / 2), ((1.2, -2.0), 0.0), ((5.8, -2.0), math.pi), ((8.2, -2.0), 0.0), ((12.8, -2.0), math.pi)]
    pieces: list[Piece] = []
    for i, ((x, y), yaw) in enumerate(spots):
        seat = x + 0.65 * math.cos(yaw), y + 0.65 * math.sin(yaw)
        pieces += [table(1.4, 0.7).placed((x, y), yaw + math.pi / 2, f"desk {i}"), chair().placed(seat, yaw + math.pi, f"desk chair {i}")]
    shelf = block(0.35, 1.2, 1.9, "shelf")
    return [*pieces, shelf.placed((3.5, -3.55), math.pi / 2, "shelf 0"), shelf.placed((10.5, -3.55), math.pi / 2, "shelf 1")]


def _clutter(world: World) -> list[Piece]:
    """Area A: crates, chairs, bins at all angles, off the tour."""
    random = np.random.default_rng(CLUTTER_SEED)
    ways = np.array([(*a, *b) for a, b in world.legs()])
    kinds = [table(1.2, 0.7), *(chair(),) * 4, drum(0.17, 0.45, "bin"), drum(0.12, 0.9, "roll"), drum(0.2, 0.6, "barrel")]
    kinds += [block(0.5, 0.35, 0.4, "crate"), block(0.3, 0.3, 0.5, "carton"), block(0.7, 0.4, 0.6, "chest")] * 2
    kinds += [block(0.45, 0.9, 1.6, "locker", "glossy"), block(0.3, 0.6, 1.1, "rack", "dark")]
    pieces: list[Piece] = []
    for i, kind in enumerate(kinds):
        surroundings = Surroundings((*world.walls, *(part for piece in pieces for part in piece.parts)), world.doors)
        for _ in range(100):
            at = random.uniform(AREA_A.x0 + 0.3, AREA_A.x1 - 0.3), random.uniform(AREA_A.y0 + 0.3, AREA_A.y1 - 0.3)
            piece = kind.placed(at, random.uniform(-math.pi, math.pi), f"clutter {i}")
            if surroundings.leave_room_for(piece) and keeps_clear(piece, ways, CLUTTER_CLEARANCE):
                pieces.append(piece)
                break
    return pieces


def _posters() -> tuple[Poster, ...]:
    """Along the corridor and in the meeting room, 5 cm from the walls' centre lines."""
    north, south = -math.pi / 2, math.pi / 2
    places = [(1.5, 1.65, north), (3.5, 1.65, north), (12.3, 1.65, north), (6.0, 0.05, south), (8.6, 0.05, south), (2.7, 6.55, north)]
    return tuple(Poster((x, y, 1.1), round(yaw, 4), seed=i) for i, (x, y, yaw) in enumerate(places))
