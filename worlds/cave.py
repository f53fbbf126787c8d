"""A cave: smooth walls without a straight line, and rocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from worlds.errors import WorldOptionError
from worlds.floor_plan import loop
from worlds.parts import FloatArray, Point, Wall
from worlds.raster import Mask, components
from worlds.touring import with_tour
from worlds.world import World

CELL = 0.1
ROUGHNESS = 0.45
"""Distance over which the cave changes its shape [m]."""
RIM = 4.0
"""How much more likely rock is at the rim, in standard deviations of the noise."""
OPEN_SHARE = 0.66
"""Share of the floor that is open before narrow places are shut."""
NARROWEST = 0.4
"""Half of the narrowest passage [m]."""
STEP = 5
"""Sides of cells to one wall."""
SMALLEST_ROCK = 16
"""Sides of cells round the smallest rock that is kept."""
HEIGHT = 1.5

Corner = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Cave:
    """A cave of one piece; every seed makes another."""

    width: float = 11.0
    """Along x [m], 6 to 30."""
    depth: float = 8.0
    """Along y [m], 6 to 30."""
    seed: int = 0
    tour: bool = True
    """Whether a tour is looked for, which takes longer than all the rest."""

    def __post_init__(self) -> None:
        for option, value in (("width", self.width), ("depth", self.depth)):
            if not 6.0 <= value <= 30.0:
                raise WorldOptionError("cave", option, f"must be 6 to 30 m, got {value}")

    def build(self) -> World:
        """Make the cave; the robot starts where it has the most room."""
        hollow = self._hollow(np.random.default_rng(self.seed))
        row, col = np.unravel_index(np.argmax(ndimage.distance_transform_edt(hollow)), hollow.shape)
        start = (round((float(col) + 0.5) * CELL, 3), round((float(row) + 0.5) * CELL, 3), 0.0)
        description = f"{hollow.sum() * CELL**2:.0f} m^2 cave, seed {self.seed}"
        world = World("cave", cave_walls(hollow), start, description)
        return with_tour(world) if self.tour else world

    def _hollow(self, random: np.random.Generator) -> Mask:
        """Open cells: the largest area in which a disc as wide as the narrowest passage gets about."""
        shape = round(self.depth / CELL), round(self.width / CELL)
        noise = ndimage.gaussian_filter(random.standard_normal(shape), ROUGHNESS / CELL)
        rim = np.pad(np.ones((shape[0] - 2, shape[1] - 2), np.bool_), 1)
        rock = noise / noise.std() + RIM * np.exp(-ndimage.distance_transform_edt(rim) * CELL / ROUGHNESS)
        open_cells = (rock < np.quantile(rock, OPEN_SHARE)) & rim
        middles = components(ndimage.distance_transform_edt(open_cells) * CELL >= NARROWEST)
        largest = np.argmax(np.bincount(middles.ravel())[1:]) + 1
        return ndimage.distance_transform_edt(middles != largest) * CELL < NARROWEST


def cave_walls(hollow: Mask) -> tuple[Wall, ...]:
    """Smooth walls round open cells of `CELL`; none stands in the outermost cells."""
    return tuple(wall for line in _outlines(hollow) for wall in _rock_face(line))


def _outlines(hollow: Mask) -> list[NDArray[np.int64]]:
    """Closed lines (N, 2) along the sides of cells, as (x, y) in cells, with the open cells on the left."""
    after: dict[Corner, list[Corner]] = {}
    for row, col in np.argwhere(hollow).tolist():
        ring = [(col, row), (col + 1, row), (col + 1, row + 1), (col, row + 1)]
        beyond = [(row - 1, col), (row, col + 1), (row + 1, col), (row, col - 1)]
        for i, cell in enumerate(beyond):
            if not hollow[cell]:
                after.setdefault(ring[i], []).append(ring[(i + 1) % 4])
    lines: list[NDArray[np.int64]] = []
    while after:
        line = [next(iter(after))]
        while line[-1] in after:
            at = line[-1]
            line.append(after[at].pop())
            if not after[at]:
                del after[at]
        lines.append(np.array(line[:-1]))
    return lines


def _rock_face(line: NDArray[np.int64]) -> tuple[Wall, ...]:
    """Walls along a line that is smoothed; none round what is hardly a rock."""
    if len(line) < SMALLEST_ROCK:
        return ()
    smooth: FloatArray = ndimage.gaussian_filter1d(line.astype(np.float64) * CELL, 2.0, axis=0, mode="wrap")
    corners: list[Point] = [(x, y) for x, y in smooth[::STEP].round(3).tolist()]
    return loop(corners, HEIGHT)
