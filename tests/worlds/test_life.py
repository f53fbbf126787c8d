import functools
import math

import numpy as np
import pytest

from worlds.geometry import apart
from worlds.life import TOUR_CLEARANCE
from worlds.living import PERSON_RADIUS
from worlds.loader import load_world

BUSY = ["aruco_room", "corridor", "hall", "maze", "office"]
HALF_GAP = 0.015


@functools.cache
def world(text):
    return load_world(text)


def parts_by_piece(world):
    pieces = {}
    for part in (*world.boxes, *world.cylinders):
        pieces.setdefault(part.piece or part.name, []).append(part)
    return pieces


def moved_pieces(before, after):
    old, new = parts_by_piece(before), parts_by_piece(after)
    return {name: (old[name], new[name]) for name in old if old[name] != new[name]}


@pytest.mark.parametrize("name", BUSY)
def test_people_walk_on_free_ways(name):
    people = world(f"{name}:people=3,seed=0").people
    assert len(people) == 3
    obstacles = world(name)
    for person in people:
        assert all(obstacles.clearance(a, b) >= PERSON_RADIUS for a, b in person.legs())
        assert 1.6 <= person.height <= 1.9


def test_people_are_not_where_the_robot_starts():
    office = world("office:people=5,moved=0.3,doors=open,seed=3")
    assert all(math.dist(person.path[0], office.start[:2]) >= 1.0 for person in office.people)


def test_the_same_seed_makes_the_same_life_and_another_another():
    assert load_world("hall:people=2,moved=0.3,doors=swinging,seed=3") == world("hall:people=2,moved=0.3,doors=swinging,seed=3")
    assert world("hall:people=2,seed=3").people != world("hall:people=2,seed=4").people


def test_one_kind_of_change_does_not_stir_another():
    assert world("hall:moved=0.5,seed=3").boxes == world("hall:moved=0.5,people=2,doors=open,seed=3").boxes


@pytest.mark.parametrize(("name", "share"), [("aruco_room", 1.0), ("office", 0.3), ("hall", 0.5), ("apartment:seed=2", 0.5)])
def test_furniture_moves_a_little_and_as_one(name, share):
    before, after = world(name), world(name + ("," if ":" in name else ":") + f"moved={share},seed=2")
    moved = moved_pieces(before, after)
    movable = {part.piece or part.name for part in (*before.boxes, *before.cylinders) if part.piece or part.mass > 0.0}
    assert 0.8 * share * len(movable) <= len(moved) <= math.ceil(share * len(movable))
    for old, new in moved.values():
        shift = np.mean([part.centre for part in new], axis=0) - np.mean([part.centre for part in old], axis=0)
        assert 0.09 < np.linalg.norm(shift) <= 0.501
        spread = [[math.dist(a.centre, b.centre) for a in parts for b in parts] for parts in (old, new)]
        assert spread[0] == pytest.approx(spread[1], abs=1e-3)


@pytest.mark.parametrize("text", ["office:moved=0.5,seed=3", "office:displaced=true", "aruco_room:moved=1,seed=5"])
def test_moved_furniture_touches_nothing_and_leaves_the_tour_free(text):
    before, after = world(text.split(":")[0]), world(text)
    for _, parts in moved_pieces(before, after).values():
        for part in parts:
            others = [other for other in after.solids if other not in parts and other.z_span[0] < part.z_span[1]]
            others = [other for other in others if part.z_span[0] < other.z_span[1]]
            assert all(apart(part.footprint(), other.footprint(), HALF_GAP) for other in others)
    assert after.tour == before.tour
    assert min(after.clearance(a, b) for a, b in after.legs()) >= 0.25


def test_only_area_a_is_displaced_after_mapping():
    moved = moved_pieces(world("office"), world("office:displaced=true"))
    assert moved
    assert all(name.startswith("clutter") for name in moved)


@pytest.mark.parametrize("state", ["open", "closed", "ajar", "swinging"])
def test_all_doors_are_set(state):
    assert {door.state for door in world(f"office:doors={state}").doors} == {state}


@pytest.mark.parametrize("text", ["office:doors=closed", "office:doors=ajar", "apartment:doors=closed", "hall:doors=closed"])
def test_a_tour_leaves_out_what_a_door_has_shut(text):
    shut = world(text)
    assert len(shut.tour) >= 2
    assert min(shut.clearance(a, b) for a, b in shut.legs()) >= TOUR_CLEARANCE - 1e-3


def test_doors_that_open_leave_the_tour_as_it_was():
    assert world("office:doors=open").tour == world("office:doors=swinging").tour == world("office").tour
