import math

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from worlds.errors import WorldValueError
from worlds.parts import Box, Cylinder, Marker, Wall
from worlds.world import World

WALL = Wall((-2.0, 2.0), (2.0, 2.0), thickness=0.1, height=1.0)


def world(**changes):
    fields = {"name": "test", "walls": (WALL,), "start": (0.0, 0.0, 0.0)}
    return World(**{**fields, **changes})


def test_a_wall_is_solid_on_both_sides_of_its_centre_line():
    outlines = world().outlines(0.5)
    assert outlines.shape == (4, 4)
    assert_allclose([outlines[:, 1].min(), outlines[:, 1].max()], [1.95, 2.05])


def test_outlines_hold_only_what_is_solid_at_that_height():
    table_top = Box((0.0, -1.0), (1.0, 1.0, 0.03), z=0.7)
    assert len(world(boxes=(table_top,)).outlines(0.2)) == 4
    assert len(world(boxes=(table_top,)).outlines(0.71)) == 8
    assert world(boxes=(table_top,)).outlines(1.5).shape == (0, 4)


def test_outlines_can_leave_movable_bodies_out():
    parcel = Box((0.0, -1.0), (0.3, 0.3, 0.3), mass=1.0)
    assert len(world(boxes=(parcel,)).outlines(0.1)) == 8
    assert len(world(boxes=(parcel,)).outlines(0.1, movable=False)) == 4


def test_outlines_of_a_solid_close():
    outlines = world(walls=(Wall((0.0, 1.0), (1.0, 2.0)),)).outlines(0.1)
    assert_allclose(outlines[:, 2:], np.roll(outlines[:, :2], -1, axis=0))


@settings(deadline=None)
@given(st.floats(0.01, 2.0))
def test_a_cylinder_is_a_polygon_within_a_percent_of_its_circle(radius):
    outlines = world(cylinders=(Cylinder((0.0, -3.0), radius, 1.0),)).outlines(0.5)[4:]
    middles = (outlines[:, :2] + outlines[:, 2:]) / 2 - [0.0, -3.0]
    assert_allclose(np.hypot(*(outlines[:, :2] - [0.0, -3.0]).T), radius)
    assert (np.hypot(*middles.T) > 0.99 * radius).all()


def test_a_box_turns_counter_clockwise():
    box = Box((1.0, 0.0), (2.0, 0.2, 1.0), yaw=math.pi / 2)
    assert_allclose(sorted(box.footprint()[:, 1]), [-1.0, -1.0, 1.0, 1.0])
    assert_allclose(Box((0.0, 0.0), (2.0, 0.0001, 1.0), yaw=0.5).footprint()[1], [math.cos(0.5), math.sin(0.5)], atol=1e-3)


@settings(deadline=None)
@given(st.floats(-3.0, 3.0))
def test_marker_corners_run_clockwise_as_seen_from_the_front(yaw):
    marker = Marker(0, (1.0, 2.0, 0.4), yaw, size=0.1)
    top_left, top_right, bottom_right, _ = marker.corners()
    out = np.cross(top_right - top_left, top_right - bottom_right)
    assert_allclose(out / np.linalg.norm(out), [math.cos(yaw), math.sin(yaw), 0.0], atol=1e-9)
    assert_allclose(marker.corners().mean(axis=0), [1.0, 2.0, 0.4])
    assert top_left[2] == pytest.approx(0.45)


def test_clearance_is_zero_inside_and_across_a_solid():
    crate = world(boxes=(Box((0.0, -1.0), (0.5, 0.5, 0.5)),))
    assert crate.clearance((0.0, -1.0), (0.0, -1.0)) == 0.0
    assert crate.clearance((-1.0, -1.0), (1.0, -1.0)) == 0.0


@settings(deadline=None)
@given(st.floats(-5.0, 1.8), st.floats(-1.9, 1.9))
def test_clearance_of_a_point_before_a_wall_is_its_distance(y, x):
    assert world().clearance((x, y), (x, y)) == pytest.approx(1.95 - y)


def test_what_hangs_overhead_is_not_in_the_way():
    assert world(boxes=(Box((0.0, 0.0), (1.0, 1.0, 0.03), z=0.7),)).clearance((0.0, 0.0), (0.0, 0.0)) > 1.0


def test_the_tour_leads_back_to_its_first_waypoint():
    assert world(tour=((0.0, 0.0), (1.0, 0.0))).legs() == [((0.0, 0.0), (1.0, 0.0)), ((1.0, 0.0), (0.0, 0.0))]


def test_a_world_is_frozen():
    with pytest.raises(AttributeError):
        world().name = "other"  # pyright: ignore[reportAttributeAccessIssue]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"walls": ()}, r"wall = \[\]: .*at least one"),
        ({"walls": (Wall((1.0, 1.0), (1.0, 1.0)),)}, r"wall\[0\]\.to = \[1\.0, 1\.0\]: must differ"),
        ({"start": (0.0, 1.9, 0.0)}, r"start = \[0\.0, 1\.9\]: needs 0\.13 m of free space, has 0\.050 m"),
        ({"start": (0.0, math.nan, 0.0)}, r"start\[1\] = nan: must be a finite number"),
        ({"start": (0.0, 0.0, 90.0)}, r"start\[2\] = 90\.0: must be a number <= 6\.28"),
        ({"tour": ((0.0, 0.0), (0.0, 1.9))}, r"tour\[1\] = \[0\.0, 1\.9\]: needs 0\.13 m"),
        ({"tour": ((0.0, 0.0), (-3.0, 0.0), (-3.0, 4.0), (0.0, 4.0))}, r"tour\[0\] = .* on the way from \[0\.0, 4\.0\] to \[0\.0, 0\.0\]"),
        ({"tour": ((0.0, 4.0),)}, r"tour\[0\] = .* on the way"),
        ({"boxes": (Box((3.0, 0.0), (1.0, -2.0, 0.5)),)}, r"box\[0\]\.size\[1\] = -2\.0: must be a number > 0"),
        ({"cylinders": (Cylinder((3.0, 0.0), 0.1, math.inf),)}, r"cylinder\[0\]\.height = inf: must be a finite"),
        ({"dictionary": "DICT_9X9"}, r"dictionary = 'DICT_9X9': must be one of DICT_4X4_250"),
        ({"markers": (Marker(250, (0.0, 1.95, 0.4), 0.0),)}, r"marker\[0\]\.id = 250: must be below 250"),
        ({"markers": (Marker(7, (0.0, 1.95, 0.4), 0.0),) * 2}, r"marker\[1\]\.id = 7: must be unique, marker\[0\]"),
    ],
)
def test_an_impossible_world_names_key_value_and_what_is_allowed(changes, message):
    with pytest.raises(WorldValueError, match=message):
        world(**changes)


def test_a_struct_decoder_refuses_an_impossible_world_too():
    with pytest.raises(WorldValueError, match="at least one wall"):
        msgspec.convert({"name": "x", "wall": [], "start": [0, 0, 0]}, World)
