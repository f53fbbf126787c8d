"""A burrow: chambers joined by bent tunnels, without a straight line."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from worlds.cave import CELL, cave_walls
from worlds.grounds import Ground
from worlds.parts import FloatArray
from worlds.raster import Mask
from worlds.world import World

CHAMBER = (0.7, 1.3)
"""Radii of the chambers [m]."""
TUNNEL = (0.45, 0.65)
"""Half widths of the tunnels [m]."""
APART = 2.6
"""Between the middles of two chambers at least [m]."""
SHORTCUTS = 0.3
"""Tunnels beside those that join everything, for each chamber."""


@dataclass(frozen=True, slots=True)
class Burrow(Ground):
    """Round chambers and bent tunnels, with a few loops."""

    def build(self) -> World:
        """Make the burrow; the robot starts in one of the chambers."""
        random = np.random.default_rng(self.seed)
        chambers = self._chambers(random)
        hollow = self._hollow(chambers, random)
        start = (*chambers[int(random.integers(len(chambers)))].round(3).tolist(), round(random.uniform(-3.1, 3.1), 3))
        description = f"{len(chambers)} chambers, seed {self.seed}"
        return self.finished(World("burrow", cave_walls(hollow), start, description))

    def _chambers(self, random: np.random.Generator) -> FloatArray:
        """Middles (N, 2) [m], far apart."""
        margin = CHAMBER[1] + 0.3
        places = random.uniform((margin, margin), (self.width - margin, self.depth - margin), (40 + int(2 * self.width * self.depth), 2))
        chosen = [places[0]]
        for place in places[1:]:
            if min(math.dist(place, other) for other in chosen) >= APART:
                chosen.append(place)
        return np.array(chosen)

    def _hollow(self, chambers: FloatArray, random: np.random.Generator) -> Mask:
        """Open cells: discs along bent lines."""
        depths = np.zeros((round(self.depth / CELL), round(self.width / CELL)))
        for place in chambers:
            _dig(depths, place, random.uniform(*CHAMBER))
        for i, k in _joined(chambers, random):
            a, b, half = chambers[i], chambers[k], random.uniform(*TUNNEL)
            bend = random.uniform(-0.5, 0.5) * np.array([a[1] - b[1], b[0] - a[0]]) * 0.5
            for t in np.linspace(0.0, 1.0, math.ceil(math.dist(a, b) / (2.0 * CELL)) + 1).tolist():
                _dig(depths, (1.0 - t) * a + t * b + 4.0 * t * (1.0 - t) * bend, half)
        rim = np.pad(np.ones((depths.shape[0] - 6, depths.shape[1] - 6), np.bool_), 3)
        return (depths > 0.0) & rim


def _dig(depths: FloatArray, place: FloatArray, radius: float) -> None:
    """Open the cells of a disc [m]."""
    (x, y), reach = place / CELL - 0.5, radius / CELL
    low, high = np.maximum((int(y - reach), int(x - reach)), 0), (int(y + reach) + 2, int(x + reach) + 2)
    rows, cols = np.ogrid[low[0] : min(high[0], depths.shape[0]), low[1] : min(high[1], depths.shape[1])]
    depths[low[0] : high[0], low[1] : high[1]] += (rows - y) ** 2 + (cols - x) ** 2 <= reach**2


def _joined(chambers: FloatArray, random: np.random.Generator) -> list[tuple[int, int]]:
    """Pairs of chambers with a tunnel between: the shortest tree, and some of the next shortest."""
    count = len(chambers)
    lengths = np.linalg.norm(chambers[:, None] - chambers, axis=2)
    pairs = sorted(((i, k) for i in range(count) for k in range(i)), key=lambda pair: float(lengths[pair]))
    group, tunnels = list(range(count)), list[tuple[int, int]]()
    for i, k in pairs:
        needless = group[i] == group[k]
        if needless and (lengths[i, k] > 2.0 * APART or random.random() >= SHORTCUTS * 0.5):
            continue
        tunnels.append((i, k))
        group = [group[i] if other == group[k] else other for other in group]
    return tunnels
