"""A maze of square cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from worlds.errors import WorldOptionError
from worlds.floor_plan import CORNER_REACH, THICKNESS, loop
from worlds.parts import Point, Wall
from worlds.touring import with_tour
from worlds.world import World

Cell = tuple[int, int]
Passage = frozenset[Cell]
"""The two cells that it joins."""
CELL = 0.9
"""Side of a cell from wall centre to wall centre [m]."""
HEIGHT = 1.0
SHORTCUTS = 0.08
"""Share of the inner walls that are left out though there is another way."""


@dataclass(frozen=True, slots=True)
class Maze:
    """Narrow ways between thin walls; every cell can be reached, and a few shortcuts make loops."""

    columns: int = 8
    """3 to 25."""
    rows: int = 7
    """3 to 25."""
    seed: int = 0
    tour: bool = True
    """Whether a tour is looked for, which takes longer than all the rest."""

    def __post_init__(self) -> None:
        for option, value in (("columns", self.columns), ("rows", self.rows)):
            if not 3 <= value <= 25:
                raise WorldOptionError("maze", option, f"must be 3 to 25, got {value}")

    def build(self) -> World:
        """Make the maze; the robot starts in the cell at the origin."""
        random = np.random.default_rng(self.seed)
        passages = self._passages(random)
        width, depth = round(self.columns * CELL, 3), round(self.rows * CELL, 3)
        walls = [*loop([(0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)], HEIGHT)]
        walls += self._inner_walls({passage for passage in self._borders() if passage not in passages and random.random() >= SHORTCUTS})
        description = f"{self.columns} x {self.rows} cells of {CELL} m, seed {self.seed}"
        world = World("maze", tuple(walls), (CELL / 2, CELL / 2, 0.0), description=description)
        return with_tour(world, stops=5, reach=25.0) if self.tour else world

    def _borders(self) -> list[Passage]:
        """All pairs of neighbouring cells, in order."""
        cells = [(i, k) for i in range(self.columns) for k in range(self.rows)]
        right = [frozenset({(i, k), (i + 1, k)}) for i, k in cells if i + 1 < self.columns]
        return right + [frozenset({(i, k), (i, k + 1)}) for i, k in cells if k + 1 < self.rows]

    def _passages(self, random: np.random.Generator) -> set[Passage]:
        """A tree that joins all cells: the track of a walk that turns back where it is stuck."""
        track: list[Cell] = [(0, 0)]
        seen, passages = {(0, 0)}, set[Passage]()
        while track:
            i, k = track[-1]
            near = [(i + 1, k), (i, k + 1), (i - 1, k), (i, k - 1)]
            fresh = [c for c in near if c not in seen and 0 <= c[0] < self.columns and 0 <= c[1] < self.rows]
            if fresh:
                track.append(fresh[int(random.integers(len(fresh)))])
                seen.add(track[-1])
                passages.add(frozenset(track[-2:]))
            else:
                track.pop()
        return passages

    def _inner_walls(self, closed: set[Passage]) -> list[Wall]:
        """Walls between cells, straight runs as one."""
        upright = {(i, k) for i in range(1, self.columns) for k in range(self.rows) if frozenset({(i - 1, k), (i, k)}) in closed}
        level = {(k, i) for i in range(self.columns) for k in range(1, self.rows) if frozenset({(i, k - 1), (i, k)}) in closed}
        runs = [*(((i, a), (i, b)) for i, a, b in _runs(upright)), *(((a, k), (b, k)) for k, a, b in _runs(level))]
        return [_wall(a, b) for a, b in runs]


def _runs(sides: set[Cell]) -> list[tuple[int, int, int]]:
    """Line, begin and end of unbroken runs of sides (line, place)."""
    runs: list[tuple[int, int, int]] = []
    for line, place in sorted(sides):
        if runs and runs[-1][0] == line and runs[-1][2] == place:
            runs[-1] = (line, runs[-1][1], place + 1)
        else:
            runs.append((line, place, place + 1))
    return runs


def _wall(a: Cell, b: Cell) -> Wall:
    """Longer than from knot to knot, so that corners are closed."""
    turn = (CORNER_REACH, 0.0) if a[1] == b[1] else (0.0, CORNER_REACH)
    begin: Point = (round(a[0] * CELL - turn[0], 3), round(a[1] * CELL - turn[1], 3))
    return Wall(begin, (round(b[0] * CELL + turn[0], 3), round(b[1] * CELL + turn[1], 3)), THICKNESS, HEIGHT)
