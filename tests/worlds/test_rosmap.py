import functools
import math
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from slam.grid import GridGeometry, OccupancyGrid
from slam.map_file import read_map, write_map
from slam.se2 import SE2
from worlds.errors import WorldFileError
from worlds.loader import load_world
from worlds.rectangles import rectangles

MAPS = ["turtlebot3_map", "nav2_depot", "f1tenth_levine", "f1tenth_stata_basement"]


@functools.cache
def world(path):
    return load_world(f"map:file={path}")


@pytest.fixture(params=MAPS)
def path(request, shared_data) -> Path:
    return shared_data / "maps" / f"{request.param}.yaml"


def drawn(tmp_path, rows, pose=None):
    """A map of 10 cm cells drawn as text, top row first: # solid, ? unknown, else free."""
    states = np.array([[{"#": 100, "?": -1}.get(c, 0) for c in row] for row in rows[::-1]], np.int8)
    geometry = GridGeometry(0.1, states.shape[1], states.shape[0], pose or SE2(5.0, 5.0, 0.0))
    write_map(OccupancyGrid.from_states(geometry, states), tmp_path / "drawn")
    return tmp_path / "drawn.yaml"


ROOM = ["#" * 20, *["#" + " " * 18 + "#"] * 14, "#" * 20]


def test_walls_stand_on_cells_that_are_not_free(path):
    grid = read_map(path)
    middles = np.array([wall.centre for wall in world(path).walls])
    cells = grid.geometry.to_cells(middles)
    inside = grid.geometry.contains(cells)
    lengths = np.array([wall.length for wall in world(path).walls])[inside]
    solid = grid.states()[tuple(cells[inside].T)] != 0
    assert lengths[solid].sum() / lengths.sum() >= 0.9  # the rest closes corridors that are open in the map


def test_a_map_becomes_few_walls(path):
    assert len(world(path).walls) < 2500


def test_start_and_tour_are_free(path):
    made = world(path)
    assert made.clearance(made.start[:2], made.start[:2]) >= 0.4
    assert len(made.tour) >= 4
    assert min(made.clearance(a, b) for a, b in made.legs()) >= 0.25


def test_no_way_leads_out_of_a_map(path):
    made = world(path)
    x0, y0, x1, y1 = made.bounds
    cell = 0.025
    solid = np.zeros((int((y1 - y0) / cell) + 5, int((x1 - x0) / cell) + 5), bool)
    for wall in made.walls:
        low, high = wall.footprint().min(axis=0), wall.footprint().max(axis=0)
        i, k = (low - [x0, y0]) / cell + 1.9, (high - [x0, y0]) / cell + 2.1
        solid[math.ceil(i[1]) : math.floor(k[1]) + 1, math.ceil(i[0]) : math.floor(k[0]) + 1] = True
    rooms, _ = ndimage.label(~solid)
    start = rooms[round((made.start[1] - y0) / cell + 2), round((made.start[0] - x0) / cell + 2)]
    assert start > 0
    assert start != rooms[0, 0]


def test_walls_stand_where_the_map_has_them(tmp_path):
    made = load_world(f"map:file={drawn(tmp_path, ROOM)}")
    assert made.bounds == pytest.approx((5.0, 5.0, 7.0, 6.6))
    assert len(made.walls) == 4
    assert made.name == "drawn"


def test_a_turned_map_is_a_turned_world(tmp_path):
    made = load_world(f"map:file={drawn(tmp_path, ROOM, SE2(1.0, 2.0, 0.5))}")
    corners = np.vstack([wall.footprint() for wall in made.walls])
    assert np.linalg.norm(corners - SE2(1.0, 2.0, 0.5).transform(np.array([[2.0, 1.6]])), axis=1).min() < 1e-4


def test_the_area_at_the_origin_of_the_map_goes_before_a_larger_one(tmp_path):
    rows = ["#" * 36, *["#" + " " * 12 + "#" + " " * 21 + "#"] * 14, "#" * 36]
    assert load_world(f"map:file={drawn(tmp_path, rows, SE2(-0.7, -0.8, 0.0))}").bounds[2] == pytest.approx(-0.7 + 1.4)
    assert load_world(f"map:file={drawn(tmp_path, rows, SE2(9.0, 9.0, 0.0))}").bounds[0] == pytest.approx(9.0 + 1.3)


def test_unknown_cells_are_walls(tmp_path):
    rows = [row.replace("#", "?") for row in ROOM]
    assert load_world(f"map:file={drawn(tmp_path, rows)}").bounds == pytest.approx((5.0, 5.0, 7.0, 6.6))


def test_a_map_without_walls_gets_them_at_its_border(tmp_path):
    assert load_world(f"map:file={drawn(tmp_path, [' ' * 20] * 16)}").bounds == pytest.approx((4.9, 4.9, 7.1, 6.7))


@pytest.mark.parametrize(
    ("rows", "problem"), [(["#" * 9] * 9, "has no free cell"), (["###", "# #", "###"], "has no free place for a robot")]
)
def test_a_map_without_room_is_refused(rows, problem, tmp_path):
    with pytest.raises(WorldFileError, match=rf"drawn\.yaml: {problem}"):
        load_world(f"map:file={drawn(tmp_path, rows)}")


def test_a_missing_map_is_one_line():
    with pytest.raises(WorldFileError, match=r"gone\.yaml: is no map: .*cannot be read"):
        load_world("map:file=gone.yaml")


def test_people_walk_in_a_map(tmp_path):
    assert len(load_world(f"map:file={drawn(tmp_path, ROOM)},people=2,seed=1").people) == 2


def test_rectangles_cover_exactly_what_is_set():
    mask = np.random.default_rng(4).random((40, 30)) < 0.6
    covered = np.zeros(mask.shape, int)
    for r0, c0, r1, c1 in rectangles(mask):
        covered[r0:r1, c0:c1] += 1
    assert (covered == mask).all()
    assert len(rectangles(np.ones((5, 9), bool))) == 1
