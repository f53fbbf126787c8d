"""Generated worlds by name. A generator is a frozen dataclass: its fields are the options, `build()` makes the world."""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

from worlds.aruco_room import ArucoRoom
from worlds.world import World


class Generator(Protocol):
    """Parameters that make a world, the same one every time."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def build(self) -> World:
        """Make the world."""
        ...


GENERATORS: dict[str, type[Generator]] = {"aruco_room": ArucoRoom}
"""name -> frozen dataclass of options with `build() -> World`."""
