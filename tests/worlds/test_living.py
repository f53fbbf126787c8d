import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from worlds.living import AJAR, SWING_TIME, Door, Light, Person
from worlds.parts import Wall
from worlds.world import World


def door(state, **fields):
    return Door((1.0, 2.0), 0.0, width=0.8, state=state, **fields)


@pytest.mark.parametrize(("state", "angle"), [("closed", 0.0), ("open", math.pi / 2), ("ajar", AJAR * math.pi / 2)])
def test_a_door_that_does_not_swing_stays_as_it_is(state, angle):
    assert [door(state).angle_at(t) for t in (0.0, 100.0)] == pytest.approx([angle, angle], abs=1e-4)


def test_a_closed_leaf_reaches_from_the_hinge_along_its_yaw():
    assert_allclose(door("closed").footprint().mean(axis=0), [1.4, 2.0])
    assert_allclose(door("open").footprint().mean(axis=0), [1.0, 2.4], atol=1e-4)
    assert_allclose(door("open", opening=-1.5708).footprint().mean(axis=0), [1.0, 1.6], atol=1e-4)


def test_a_swinging_door_is_open_at_first_then_closes_and_opens_every_period():
    swinging = door("swinging", delay=5.0, period=20.0)
    assert swinging.angle_at(0.0) == swinging.angle_at(5.0) == swinging.opening
    for start in (5.0, 25.0, 225.0):
        assert swinging.angle_at(start + SWING_TIME) == pytest.approx(0.0, abs=1e-9)
        assert swinging.angle_at(start + 10.0) == pytest.approx(0.0, abs=1e-9)
        assert swinging.angle_at(start + 10.0 + SWING_TIME) == pytest.approx(swinging.opening)


@given(st.floats(0.0, 300.0))
def test_a_door_never_jumps(t):
    swinging = door("swinging", delay=3.0, period=7.0)
    assert abs(swinging.angle_at(t + 0.002) - swinging.angle_at(t)) < 0.004


def test_light_blends_from_level_to_level():
    light = Light(levels=((10.0, 1.0), (20.0, 0.5)))
    assert [light.level_at(t) for t in (0.0, 15.0, 99.0)] == [1.0, 0.75, 0.5]
    assert Light().level_at(5.0) == 1.0


def test_a_person_walks_back_to_the_first_waypoint():
    assert Person(((0.0, 0.0), (1.0, 0.0))).legs() == [((0.0, 0.0), (1.0, 0.0)), ((1.0, 0.0), (0.0, 0.0))]
    assert Person(((0.0, 0.0),)).legs() == []


def test_a_door_is_an_outline_as_it_is_at_first_and_a_person_is_none():
    walls = (Wall((-3.0, 3.0), (3.0, 3.0)),)
    world = World("x", walls, (0.0, 0.0, 0.0), doors=(door("closed"),), people=(Person(((0.0, 1.0),)),))
    assert len(world.outlines(0.2)) == 8
    assert_allclose(world.outlines(0.2)[4:, 1].mean(), 2.0)
    assert world.clearance((1.4, 0.0), (1.4, 1.0)) == pytest.approx(0.98)
