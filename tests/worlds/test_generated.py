import functools

import numpy as np
import pytest
from scipy import ndimage

from worlds.loader import load_world
from worlds.world import ROBOT_HEIGHT, ROBOT_RADIUS

FAMILIES = ("apartment", "burrow", "cave", "clutter", "flat", "forest", "maze", "office_random", "warehouse", "wing")
CELL = 0.02
"""Of the fixture `cells`."""
SEEDS = [f"{name}:seed={seed}" for name in FAMILIES for seed in (1, 7)]


@functools.cache
def made(text):
    return load_world(text)


@pytest.fixture
def space(request, cells):
    """Clearance of cells of 2 cm, the areas that air fills, and the cell of the start."""
    solid, places = cells(made(request.param), ROBOT_HEIGHT)
    air, _ = ndimage.label(~solid)
    return ndimage.distance_transform_edt(~solid) * CELL, air, places(made(request.param).start[:2])


@pytest.mark.parametrize("space", SEEDS, indirect=True)
def test_the_robot_reaches_every_place_where_it_fits(space):
    clearance, air, start = space
    fits = (air == air[start]) & (clearance >= ROBOT_RADIUS)
    places, _ = ndimage.label(fits)
    assert places[start] > 0
    assert (fits & (places != places[start])).sum() == 0


@pytest.mark.parametrize("space", [text for text in SEEDS if "cave" not in text and "burrow" not in text], indirect=True)
def test_no_room_is_sealed(space):
    clearance, air, start = space
    assert not ((clearance >= ROBOT_RADIUS) & (air != air[start]) & (air != air[0, 0])).any()


@pytest.mark.parametrize("text", SEEDS)
def test_every_seed_has_a_tour_that_keeps_clear(text):
    world = made(text)
    assert len(world.tour) >= 4
    assert world.start[:2] == world.tour[0]
    assert min(world.clearance(a, b) for a, b in world.legs()) >= 0.25


@pytest.mark.parametrize("name", FAMILIES)
def test_another_seed_makes_another_world(name):
    assert made(f"{name}:seed=1").solids != made(f"{name}:seed=7").solids


def test_a_cave_has_hardly_a_straight_line():
    yaws = np.array([wall.yaw for wall in made("cave:seed=1").walls])
    along_axes = np.abs(np.remainder(yaws + np.pi / 4, np.pi / 2) - np.pi / 4) < 0.01
    assert along_axes.mean() < 0.2


def test_a_flat_has_furniture_of_several_pieces():
    world = made("apartment:seed=1")
    assert len({part.piece for part in (*world.boxes, *world.cylinders)}) >= 8
