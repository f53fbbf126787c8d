from collections.abc import Callable
from pathlib import Path

import pytest

from worlds.parts import Box, Cylinder, Wall
from worlds.toml_file import dump_world
from worlds.world import World

ROOM = (
    Wall((2.05, -1.6), (2.05, 1.6), 0.1, 1.0),
    Wall((2.0, 1.55), (-2.0, 1.55), 0.1, 1.0),
    Wall((-2.05, 1.6), (-2.05, -1.6), 0.1, 1.0),
    Wall((-2.0, -1.55), (2.0, -1.55), 0.1, 1.0),
)
"""4 x 3 m inside, about the origin."""


def make_room(
    boxes: tuple[Box, ...] = (), cylinders: tuple[Cylinder, ...] = (), start: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> World:
    return World(name="room", walls=ROOM, start=start, boxes=boxes, cylinders=cylinders)


@pytest.fixture(scope="session")
def room() -> Callable[..., World]:
    """A closed room of 4 x 3 m with what the test puts in."""
    return make_room


@pytest.fixture
def room_file(tmp_path: Path) -> Callable[..., str]:
    """The room as a file that `Sim(world=...)` takes."""

    def write(**contents) -> str:
        path = tmp_path / "room.toml"
        path.write_text(dump_world(make_room(**contents)))
        return str(path)

    return write
