import functools

import numpy as np
import pytest
from scipy import ndimage

from worlds.errors import UnknownWorldError, WorldFileError, WorldOptionError
from worlds.geometry import contains
from worlds.loader import load_world, world_names
from worlds.toml_file import dump_world, parse_world
from worlds.world import ROBOT_RADIUS


@functools.cache
def loaded(name):
    return load_world(name)


@pytest.fixture(params=world_names())
def world(request):
    return loaded(request.param)


def test_no_way_leads_out_of_a_world(world, cells):
    solid, places = cells(world, 0.18)
    rooms, _ = ndimage.label(~solid)
    reached = rooms == rooms[places(world.start[:2])]
    assert not any(edge.any() for edge in (reached[0], reached[-1], reached[:, 0], reached[:, -1]))
    assert reached.sum() * 0.02**2 > 10.0


def test_the_start_is_free(world):
    assert world.clearance(world.start[:2], world.start[:2]) >= ROBOT_RADIUS


def test_the_tour_is_free(world):
    assert world.tour
    assert min(world.clearance(a, b) for a, b in world.legs()) >= 0.25


def test_marker_ids_are_unique(world):
    assert len({marker.id for marker in world.markers}) == len(world.markers)


def test_every_marker_lies_on_a_surface_and_looks_away_from_it(world):
    for marker in world.markers:
        x, y, z = marker.position
        step = 1e-4 * np.array([np.cos(marker.yaw), np.sin(marker.yaw)])
        parts = [part for part in world.solids if part.z_span[0] <= z < part.z_span[1]]
        assert any(contains(part.footprint(), np.array([x, y]) - step) for part in parts)
        assert not any(contains(part.footprint(), np.array([x, y]) + step) for part in parts)


def test_a_world_survives_its_file(world):
    assert parse_world(dump_world(world), "copy.toml") == world


def test_a_world_is_the_same_every_time(world):
    assert load_world(world.name) == world


def test_a_path_is_a_world(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(dump_world(load_world("corridor")))
    assert load_world(str(path)) == load_world("corridor")


def test_an_unknown_world_lists_the_others_and_the_nearest():
    with pytest.raises(
        UnknownWorldError, match=r"no world 'aruco_rom'; available: apartment, aruco_room.*map:file=FILE.yaml.*did you mean aruco_room\?"
    ):
        load_world("aruco_rom")


def test_a_path_takes_options_too(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(dump_world(load_world("corridor")))
    assert len(load_world(f"{path}:people=2,seed=4").people) == 2


def test_a_missing_file_is_named():
    with pytest.raises(WorldFileError, match=r"/nowhere/x\.toml: cannot be read"):
        load_world("/nowhere/x.toml")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("aruco_room:gap=0.3", "option gap: .*options: size, spacing, marker_size, furniture"),
        ("aruco_room:spacing", "option spacing: write option=value"),
        ("aruco_room:spacing=wide", "option spacing: must be a number, got 'wide'"),
        ("aruco_room:spacing=0.1", r"option spacing: must be 0\.150 m .* to 5\.0 m, got 0\.1"),
        ("aruco_room:size=nan", "option size: must be 4 to 12 m, got nan"),
        ("aruco_room:marker_size=-1", r"option marker_size: must be 0\.02 to 0\.3 m, got -1\.0"),
        ("aruco_room:size=12,spacing=0.15", "makes 320 markers, DICT_ARUCO_MIP_36h12 has 250"),
        ("aruco_room:furniture=some", "option furniture: must be true or false, got 'some'"),
        ("corridor:length=3", "option length: write option=value; options: people, moved, doors, seed"),
        ("corridor:people=-1", "option people: must be 0 to 50, got -1"),
        ("corridor:moved=1.5", r"option moved: must be 0 to 1, got 1\.5"),
        ("corridor:doors=half", "option doors: must be one of kept, closed, open, ajar, swinging, got 'half'"),
        ("corridor:seed=-1", "option seed: must be 0 or above"),
        ("maze:rows=2", "option rows: must be 3 to 25, got 2"),
        ("cave:width=3", r"option width: must be 6 to 30 m, got 3\.0"),
        ("apartment:depth=3", r"option depth: must be 6 to 16 m, got 3\.0"),
        ("office_random:corridor=1", r"option corridor: must be 1\.2 to 4 m, got 1\.0"),
        ("office_random:length=3", r"option length: must be 6 to 40 m, got 3\.0"),
        ("map", "option file: is necessary: map:file="),
        ("map:file=x.yaml,height=0", r"option height: must be 0\.4 to 10 m, got 0\.0"),
    ],
)
def test_a_wrong_option_names_what_is_allowed(text, message):
    with pytest.raises(WorldOptionError, match=message):
        load_world(text)
