"""Generated worlds by name. A generator is a frozen dataclass: its fields are the options, `build()` makes the world."""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

from worlds.apartment import Apartment
from worlds.aruco_room import ArucoRoom
from worlds.burrow import Burrow
from worlds.cave import Cave
from worlds.clutter import Clutter
from worlds.flat import Flat
from worlds.forest import Forest
from worlds.hall import Hall
from worlds.maze import Maze
from worlds.office import Office
from worlds.office_random import OfficeRandom
from worlds.rosmap import RosMap
from worlds.warehouse import Warehouse
from worlds.wing import Wing
from worlds.world import World


class Generator(Protocol):
    """Parameters that make a world, the same one every time."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def build(self) -> World:
        """Make the world."""
        ...


GENERATORS: dict[str, type[Generator]] = {
    "apartment": Apartment,
    "aruco_room": ArucoRoom,
    "burrow": Burrow,
    "cave": Cave,
    "clutter": Clutter,
    "flat": Flat,
    "forest": Forest,
    "hall": Hall,
    "map": RosMap,
    "maze": Maze,
    "office": Office,
    "office_random": OfficeRandom,
    "warehouse": Warehouse,
    "wing": Wing,
}
"""name -> frozen dataclass of options with `build() -> World`."""
PEOPLED = {"office": 3}
"""name -> how many people walk about where the option `people` does not say."""
