from typing import Any

import numpy as np
import pytest

from slam.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from slam.mapping.grid_mapper import GridMapper, MapSettings
from slam.matching.surface_field import SurfaceField
from slam.se2 import SE2

METRES = MapSettings(resolution=1.0, fixed_size=7.0, hit=2.0, miss=-2.0)
"""Seven by seven cells of one metre about the origin, sure after one scan."""
RESOLUTION = 0.0625
"""A power of two, so that cell borders of a grown and of a larger map are the same numbers."""


def insert(mapper: GridMapper, T_map_base: SE2, *points: tuple[float, float]) -> None:
    """Insert hits given in base, seen from base."""
    mapper.insert(T_map_base, np.array(points).reshape(-1, 2), np.zeros((len(points), 2)))


def picture(grid: OccupancyGrid) -> list[str]:
    """Highest y on top: # occupied, . free, blank unknown."""
    signs = {OCCUPIED: "#", FREE: ".", UNKNOWN: " "}
    return ["".join(signs[state] for state in row) for row in grid.states()[::-1].tolist()]


def test_a_wall_ahead_and_the_free_space_before_it() -> None:
    mapper = GridMapper(METRES)
    insert(mapper, SE2(), (3.0, -2.0), (3.0, -1.0), (3.0, 0.0), (3.0, 1.0), (3.0, 2.0))
    assert picture(mapper.grid)[3] == "   ...#"
    assert [row[6] for row in picture(mapper.grid)] == [" ", "#", "#", "#", "#", "#", " "]
    assert not any("." in row[:3] for row in picture(mapper.grid))


def test_points_are_turned_with_the_robot() -> None:
    mapper = GridMapper(METRES)
    insert(mapper, SE2(1.0, -2.0, np.pi / 2), (3.0, 0.0))
    assert picture(mapper.grid) == ["       ", "       ", "    #  ", "    .  ", "    .  ", "    .  ", "       "]


def test_rays_start_at_the_laser_not_at_the_axle() -> None:
    mapper = GridMapper(METRES)
    mapper.insert(SE2(), np.array([[3.0, 0.0]]), np.array([[1.0, 0.0]]))
    assert picture(mapper.grid)[3] == "    ..#"


def test_a_scan_without_points_leaves_the_map_and_its_snapshot() -> None:
    mapper = GridMapper(METRES)
    before = mapper.snapshot()
    insert(mapper, SE2())
    assert mapper.snapshot() is before


def test_a_fixed_map_drops_what_lies_outside() -> None:
    mapper = GridMapper(METRES)
    insert(mapper, SE2(), (30.0, 0.0))
    assert mapper.grid.geometry.width == 7
    assert picture(mapper.grid)[3] == "   ...."


@pytest.mark.parametrize("target", [(9.0, 0.0), (-9.0, 0.0), (0.0, 9.0), (0.0, -9.0), (12.0, -15.0)])
def test_a_map_grows_to_hold_every_hit(target: tuple[float, float]) -> None:
    mapper = GridMapper(MapSettings(resolution=0.1, hit=2.0, miss=-2.0))
    insert(mapper, SE2(), target)
    cell = mapper.grid.geometry.to_cells(np.array([target]))
    assert mapper.grid.geometry.contains(cell)[0]
    assert np.argwhere(mapper.grid.states() == OCCUPIED).tolist() == cell.tolist()


def test_growing_keeps_what_was_known_in_its_place() -> None:
    mapper = GridMapper(MapSettings(resolution=0.1, hit=2.0, miss=-2.0))
    insert(mapper, SE2(), (2.03, 0.04))
    before = mapper.grid.wall_points()
    insert(mapper, SE2(), (-19.0, 11.0))
    after = mapper.grid.wall_points()
    assert np.abs(after - before).sum(axis=1).min() < 1e-6


HALL = [
    (-6.02, -5.03, 9.04, -5.01),
    (9.04, -5.01, 9.01, 6.04),
    (9.01, 6.04, -6.03, 6.02),
    (-6.03, 6.02, -6.02, -5.03),
    (1.02, 2.01, 1.03, 4.0),
]
"""Walls off the borders of the cells, where rounding would decide to which side a hit belongs."""


def drive(mapper: GridMapper, room: Any, seed: int) -> None:
    """Noisy scans of a short range along a curve through a room that is larger than the first map: it grows again and again."""
    rng = np.random.default_rng(seed)
    for k in range(40):
        T_map_base = SE2(0.21 * k - 1.01, 3.0 * np.sin(0.3 * k) + 0.01, 0.41 * k)
        points = room.points(T_map_base, rng.normal(0.0, 0.01, 682))
        near = points[np.hypot(points[:, 0], points[:, 1]) < 4.0]
        mapper.insert(T_map_base, near, np.zeros_like(near))


def arrays(grid: OccupancyGrid) -> tuple[np.ndarray, ...]:
    return grid.log_odds, grid.hit_count, grid.hit_offset


@pytest.mark.parametrize("seed", range(4))
def test_a_map_that_grew_is_the_map_that_started_large(make_walls: Any, seed: int) -> None:
    hall = make_walls(HALL)
    grown, large = GridMapper(MapSettings(RESOLUTION)), GridMapper(MapSettings(RESOLUTION, fixed_size=32.0))
    drive(grown, hall, seed)
    drive(large, hall, seed)
    assert grown.grid.geometry.width < large.grid.geometry.width
    for small, whole in zip(arrays(grown.grid), arrays(large.grid), strict=True):
        (row, col) = large.grid.geometry.to_cells(grown.grid.geometry.to_points(np.array([[0, 0]])))[0]
        same = whole[row : row + small.shape[0], col : col + small.shape[1]]
        np.testing.assert_allclose(small, same, atol=1e-4)
        assert np.count_nonzero(whole) == np.count_nonzero(same)


@pytest.mark.parametrize("seed", range(2))
def test_the_field_stays_in_step_with_the_map(make_walls: Any, seed: int) -> None:
    hall = make_walls(HALL)
    mapper = GridMapper(MapSettings(RESOLUTION))
    drive(mapper, hall, seed)
    assert mapper.grid.geometry.width > 8.0 / RESOLUTION
    np.testing.assert_array_equal(mapper.field.squares, SurfaceField(mapper.grid).squares)


def test_a_noisy_wall_is_one_cell_thick_and_known_better_than_the_cell(make_walls: Any) -> None:
    wall = make_walls([(2.013, -2.0, 2.013, 2.0)])
    rng, mapper = np.random.default_rng(2), GridMapper(MapSettings())
    for k in range(60):
        T_map_base = SE2(0.01 * k, 0.0, 0.1 * np.sin(k))
        points = wall.points(T_map_base, rng.normal(0.0, 0.02, 682))
        mapper.insert(T_map_base, points, np.zeros_like(points))
    cells = np.argwhere(mapper.grid.occupied())
    assert len(cells) <= 1.15 * len(np.unique(cells[:, 0]))
    assert np.sqrt(np.mean((mapper.grid.wall_points()[:, 0] - 2.013) ** 2)) < 0.006


def test_the_faces_of_a_thin_wall_stay_apart(make_walls: Any) -> None:
    west, east = make_walls([(2.013, -2.0, 2.013, 2.0)]), make_walls([(2.113, -2.0, 2.113, 2.0)])
    rng, mapper = np.random.default_rng(2), GridMapper(MapSettings())
    for wall, x in ((west, 0.5), (east, 3.5)):
        for k in range(60):
            T_map_base = SE2(x, 0.01 * k, 0.1 * k)
            points = wall.points(T_map_base, rng.normal(0.0, 0.01, 682))
            mapper.insert(T_map_base, points, np.zeros_like(points))
    x, y = mapper.grid.wall_points().T
    assert np.sqrt(np.mean(np.minimum(np.abs(x - 2.013), np.abs(x - 2.113))[np.abs(y) < 1.0] ** 2)) < 0.01
    assert np.mean(np.abs(x - 2.013) < 0.02) > 0.3
    assert np.mean(np.abs(x - 2.113) < 0.02) > 0.3


def test_a_snapshot_is_frozen_and_does_not_follow() -> None:
    mapper = GridMapper(METRES)
    insert(mapper, SE2(), (3.0, 0.0))
    snapshot = mapper.snapshot()
    insert(mapper, SE2(), (0.0, 3.0))
    assert np.count_nonzero(snapshot.states() == OCCUPIED) == 1
    assert not snapshot.log_odds.flags.writeable
