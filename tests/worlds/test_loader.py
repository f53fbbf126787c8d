import numpy as np
import pytest
from scipy import ndimage

from worlds.errors import UnknownWorldError, WorldFileError, WorldOptionError
from worlds.geometry import contains
from worlds.loader import load_world, world_names
from worlds.toml_file import dump_world, parse_world
from worlds.world import ROBOT_RADIUS

CELL = 0.02


@pytest.fixture(params=world_names())
def world(request):
    return load_world(request.param)


def solid_cells(world):
    """Cells of 2 cm, one ring wider than the world, whose centre is solid at the lidar's height."""
    x0, y0, x1, y1 = world.bounds
    xs, ys = np.arange(x0 - CELL, x1 + 2 * CELL, CELL), np.arange(y0 - CELL, y1 + 2 * CELL, CELL)
    solid = np.zeros((len(ys), len(xs)), bool)
    for a, b in ((part, np.roll(part, -1, axis=0)) for part in (p.footprint() for p in world.solids if p.z_span[0] <= 0.18 < p.z_span[1])):
        sides = zip(a, b - a, strict=True)
        solid |= np.all([d[0] * (ys - p[1])[:, None] - d[1] * (xs - p[0]) >= 0.0 for p, d in sides], axis=0)
    return solid, (xs[0], ys[0])


def test_no_way_leads_out_of_a_world(world):
    solid, (x0, y0) = solid_cells(world)
    rooms, _ = ndimage.label(~solid)
    reached = rooms == rooms[round((world.start[1] - y0) / CELL), round((world.start[0] - x0) / CELL)]
    assert not any(edge.any() for edge in (reached[0], reached[-1], reached[:, 0], reached[:, -1]))
    assert reached.sum() * CELL**2 > 10.0


def test_the_start_is_free(world):
    assert world.clearance(world.start[:2], world.start[:2]) >= ROBOT_RADIUS


def test_the_tour_is_free(world):
    assert world.tour
    assert min(world.clearance(a, b) for a, b in world.legs()) >= 0.35


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
    with pytest.raises(UnknownWorldError, match=r"no world 'aruco_rom'; available: aruco_room, corridor.*did you mean aruco_room\?"):
        load_world("aruco_rom")


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
        ("corridor:length=3", "option length=3: this world is measured, it has no options"),
    ],
)
def test_a_wrong_option_names_what_is_allowed(text, message):
    with pytest.raises(WorldOptionError, match=message):
        load_world(text)
