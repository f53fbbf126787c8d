"""A warehouse: rows of shelves with aisles between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from worlds.grounds import Ground
from worlds.parts import Box
from worlds.world import World

AISLE = (0.9, 1.6)
"""Widths of the aisles [m]."""
SHELF = (0.4, 0.8)
"""Depths of the shelves [m]."""
CROSSING = 1.0
"""Width of the ways across the rows [m]."""
MISSING = 0.15
"""Share of the shelves that are not there."""


@dataclass(frozen=True, slots=True)
class Warehouse(Ground):
    """Rows of shelves, cut by ways across; some shelves are missing."""

    def build(self) -> World:
        """Make the warehouse; the robot starts in the aisle along the southern wall."""
        random = np.random.default_rng(self.seed)
        boxes: list[Box] = []
        y = first = round(random.uniform(*AISLE), 2)
        while (shelf := round(random.uniform(*SHELF), 2)) + y + AISLE[0] <= self.depth:
            boxes += self._row(y, shelf, random)
            y = round(y + shelf + random.uniform(*AISLE), 2)
        start = (round(random.uniform(0.6, self.width - 0.6), 2), round(0.5 * first, 3), 0.0)
        description = f"{self.width:g} x {self.depth:g} m warehouse, seed {self.seed}"
        return self.finished(World("warehouse", self.outer_walls(), start, description, boxes=tuple(boxes), floor="concrete"))

    def _row(self, y: float, depth: float, random: np.random.Generator) -> list[Box]:
        """Shelves side by side; the row's ends stand free, or lean on one wall."""
        x = 0.05 if random.random() < 0.3 else CROSSING
        end = self.width - CROSSING
        boxes: list[Box] = []
        while x + 1.0 <= end:
            length = min(random.uniform(1.2, 3.5), end - x)
            if random.random() >= MISSING:
                size = (round(length, 2), depth, round(random.uniform(0.6, 2.0), 2))
                boxes.append(Box((round(x + length / 2, 3), round(y + depth / 2, 3)), size, name="shelf"))
            x += length + (CROSSING if random.random() < 0.4 else 0.0)
        return boxes
