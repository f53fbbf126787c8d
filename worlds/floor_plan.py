"""Walls and doors of rooms that share them."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass

from worlds.living import Door, DoorState
from worlds.parts import Point, Wall

THICKNESS, HEIGHT = 0.1, 2.4
CORNER_REACH = THICKNESS / 2 - 0.002
"""How far a wall goes beyond its corner [m]: no face of it lies flush in another's, where renderers and ray casters would see a seam."""
DOOR_PLAY = 0.03
"""From a door's hinge, and from its edge, to the wall [m]."""


@dataclass(frozen=True, slots=True)
class Room:
    """A rectangle between the centre lines of its walls [m]."""

    x0: float
    y0: float
    x1: float
    y1: float
    kind: str = ""
    """What it is for; decides its furniture."""

    @property
    def area(self) -> float:
        """Between the centre lines [m^2]."""
        return (self.x1 - self.x0) * (self.y1 - self.y0)

    @property
    def middle(self) -> Point:
        """[m]."""
        return (self.x0 + self.x1) / 2, (self.y0 + self.y1) / 2


@dataclass(frozen=True, slots=True)
class Opening:
    """A gap in a wall."""

    middle: Point
    """On the centre line of the wall [m]."""
    upright: bool
    """Whether its wall runs along y; else along x."""
    width: float = 1.0
    side: int = 1
    """Into which side its door opens: 1 to growing x or y, -1 to the other."""
    end: int = -1
    """At which end its hinge is: 1 at the one with the greater x or y, -1 at the other."""

    def door(self, state: DoorState) -> Door:
        """A leaf that fills the gap when it is closed."""
        width = self.width - 2 * DOOR_PLAY
        x, y = self.middle
        shift = self.end * width / 2
        hinge = (x, round(y + shift, 4)) if self.upright else (round(x + shift, 4), y)
        closed = (math.pi / 2 if self.upright else 0.0) + (math.pi if self.end > 0 else 0.0)
        across = math.pi / 2 - math.pi / 2 * self.side if self.upright else self.side * math.pi / 2
        opening = math.remainder(across - closed, math.tau)
        return Door(hinge, round(closed, 4), round(width, 4), opening=round(opening, 4), state=state)


def walls_of(rooms: list[Room], openings: list[Opening]) -> tuple[Wall, ...]:
    """Walls round all rooms; where two share a wall it stands once."""
    spans: defaultdict[tuple[bool, float], list[tuple[float, float]]] = defaultdict(list)
    for room in rooms:
        for x in (room.x0, room.x1):
            spans[True, round(x, 3)].append((room.y0, room.y1))
        for y in (room.y0, room.y1):
            spans[False, round(y, 3)].append((room.x0, room.x1))
    walls: list[Wall] = []
    for (upright, place), pieces in sorted(spans.items()):
        gaps = [_gap(opening) for opening in openings if opening.upright == upright and abs(_across(opening) - place) < 1e-3]
        for low, high in _without(_joined(pieces), sorted(gaps)):
            ends = ((place, low), (place, high)) if upright else ((low, place), (high, place))
            walls.append(Wall(*ends, THICKNESS, HEIGHT))
    return tuple(walls)


def loop(corners: list[Point], height: float = HEIGHT) -> tuple[Wall, ...]:
    """Walls along a closed line, each long enough to close the corners."""
    walls: list[Wall] = []
    for (x0, y0), (x1, y1) in zip(corners, (*corners[1:], corners[0]), strict=True):
        length = math.hypot(x1 - x0, y1 - y0)
        u, v = (x1 - x0) / length * CORNER_REACH, (y1 - y0) / length * CORNER_REACH
        walls.append(Wall((round(x0 - u, 4), round(y0 - v, 4)), (round(x1 + u, 4), round(y1 + v, 4)), THICKNESS, height))
    return tuple(walls)


def _gap(opening: Opening) -> tuple[float, float]:
    along = opening.middle[1] if opening.upright else opening.middle[0]
    return along - opening.width / 2, along + opening.width / 2


def _across(opening: Opening) -> float:
    return opening.middle[0] if opening.upright else opening.middle[1]


def _joined(spans: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Spans that overlap or touch as one, longer at both ends."""
    joined: list[tuple[float, float]] = []
    for low, high in sorted(spans):
        if joined and low <= joined[-1][1] + 1e-6:
            joined[-1] = (joined[-1][0], max(joined[-1][1], high))
        else:
            joined.append((low, high))
    return [(low - CORNER_REACH, high + CORNER_REACH) for low, high in joined]


def _without(spans: list[tuple[float, float]], gaps: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """What is left of spans between gaps."""
    left: list[tuple[float, float]] = []
    for low, high in spans:
        rest = low
        for begin, end in gaps:
            if rest < begin and end < high:
                left.append((round(rest, 4), round(begin, 4)))
                rest = end
        left.append((round(rest, 4), round(high, 4)))
    return left
