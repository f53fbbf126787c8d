import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from worlds.aruco_room import ArucoRoom
from worlds.errors import WorldOptionError


@given(st.floats(4.0, 12.0))
@settings(max_examples=15, deadline=None)
def test_the_tour_keeps_clear_in_a_room_of_any_size(size):
    world = ArucoRoom(size=size, spacing=0.3).build()
    assert min(world.clearance(a, b) for a, b in world.legs()) >= 0.3


def test_the_default_room_is_five_metres_square_inside():
    world = ArucoRoom().build()
    assert world.bounds == pytest.approx((-2.6, -2.6, 2.6, 2.6))
    assert {wall.thickness for wall in world.walls} == {0.1}
    assert world.clearance((0.0, -2.2), (0.0, -2.2)) == pytest.approx(0.3)


def test_markers_stand_every_spacing_round_all_walls():
    world = ArucoRoom(spacing=0.25).build()
    places = np.array([marker.position for marker in world.markers])
    assert len(places) == 80
    steps = np.linalg.norm(np.diff(places[:20, :2], axis=0), axis=1)
    assert steps == pytest.approx(np.full(19, 0.25))
    assert places[:, 2].min() >= 0.2
    assert places[:, 2].max() <= 0.6


def test_markers_look_into_the_room():
    for marker in ArucoRoom().build().markers:
        assert np.dot(marker.position[:2], [math.cos(marker.yaw), math.sin(marker.yaw)]) == pytest.approx(-2.5)


def test_the_tour_is_ten_to_fourteen_metres_and_passes_the_middle():
    world = ArucoRoom().build()
    assert 10.0 <= sum(math.dist(a, b) for a, b in world.legs()) <= 14.0
    assert min(np.linalg.norm(np.linspace(a, b, 20), axis=1).min() for a, b in world.legs()) < 0.05


def test_the_start_looks_along_the_tour():
    world = ArucoRoom().build()
    (x0, y0), (x1, y1) = world.tour[:2]
    assert world.start == pytest.approx((x0, y0, math.atan2(y1 - y0, x1 - x0)), abs=1e-3)


def test_furniture_breaks_every_symmetry_of_the_square():
    fixed = [part for part in (*ArucoRoom().build().boxes, *ArucoRoom().build().cylinders) if part.z_span[0] < 0.18]
    places = np.array([part.centre for part in fixed])
    for turn in range(4):
        for mirror in (1, -1):
            if (turn, mirror) != (0, 1):
                c, s = round(math.cos(turn * math.pi / 2)), round(math.sin(turn * math.pi / 2))
                moved = places * [1, mirror] @ np.array([[c, s], [-s, c]])
                farthest = max(np.linalg.norm(places - place, axis=1).min() for place in moved)
                assert farthest > 0.5


def test_something_in_the_room_can_be_pushed():
    assert [part.mass for part in ArucoRoom().build().boxes if part.mass > 0.0] == [1.0]


def test_the_room_can_be_empty():
    world = ArucoRoom(furniture=False).build()
    assert world.boxes == ()
    assert world.cylinders == ()


def test_options_are_checked_in_python_too():
    with pytest.raises(WorldOptionError, match="option size"):
        ArucoRoom(size=1.0)
