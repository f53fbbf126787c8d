"""The aruco_room without markers."""

from __future__ import annotations

import pytest

from worlds.errors import WorldOptionError
from worlds.loader import load_world


def test_the_room_can_be_without_markers_and_of_brick() -> None:
    world = load_world("aruco_room:markers=false,texture=brick")
    assert world.markers == ()
    assert {wall.texture for wall in world.walls} == {"brick"}
    assert "without a marker" in world.description


def test_a_texture_that_does_not_exist_is_answered_with_those_that_do() -> None:
    with pytest.raises(WorldOptionError, match="must be plain, plaster, brick"):
        load_world("aruco_room:texture=wood")
