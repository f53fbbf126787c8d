"""What the generated grounds for exploring have in common: sides, a seed, and a tour only where it is asked for."""

from __future__ import annotations

from dataclasses import dataclass

from worlds.errors import WorldOptionError
from worlds.floor_plan import loop
from worlds.parts import Wall
from worlds.touring import with_tour
from worlds.world import World

LEAST, MOST = 5.0, 20.0
"""Sides [m]."""


@dataclass(frozen=True, slots=True)
class Ground:
    """Size and seed of a ground; the robot reaches every place of it where it fits with room."""

    width: float = 10.0
    """Along x [m], 5 to 20."""
    depth: float = 8.0
    """Along y [m], 5 to 20."""
    seed: int = 0
    tour: bool = True
    """Whether a tour is looked for, which takes longer than all the rest."""

    def __post_init__(self) -> None:
        for option in ("width", "depth"):
            value = getattr(self, option)
            if not LEAST <= value <= MOST:
                raise WorldOptionError(type(self).__name__.lower(), option, f"must be {LEAST:g} to {MOST:g} m, got {value}")

    @property
    def rectangle(self) -> tuple[float, float, float, float]:
        """x0 y0 x1 y1 [m] between the centre lines of the outer walls."""
        return 0.0, 0.0, self.width, self.depth

    def outer_walls(self) -> tuple[Wall, ...]:
        """Walls all round."""
        return loop([(0.0, 0.0), (self.width, 0.0), (self.width, self.depth), (0.0, self.depth)])

    def finished(self, world: World) -> World:
        """The world, with a tour if one is asked for."""
        return with_tour(world) if self.tour else world
