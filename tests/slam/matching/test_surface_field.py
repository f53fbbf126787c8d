from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.grid import GridGeometry, OccupancyGrid
from slam.kernels.surfaces import FLATNESS, NORMAL_X, NORMAL_Y, X, Y
from slam.matching.surface_field import SurfaceField
from slam.se2 import SE2, FloatArray

MakeGrid = Callable[[FloatArray, GridGeometry], OccupancyGrid]
WIDTH, HEIGHT, REACH = 14, 11, 4.0


def squared_distances(occupied: np.ndarray) -> np.ndarray:
    """Squared distance in cells to the nearest occupied cell of all, by trying every pair; -1 beyond REACH."""
    cells, answer = np.argwhere(occupied), np.full(occupied.shape, -1)
    for at in np.ndindex(occupied.shape):
        if len(cells) and (nearest := ((cells - at) ** 2).sum(axis=1).min()) <= REACH**2:
            answer[at] = nearest
    return answer


def held_distances(field: SurfaceField) -> np.ndarray:
    """Squared distance in cells to the cell that each cell holds as its nearest; -1 for none."""
    rows, cols = np.indices(field.nearest.shape)
    squares = (rows - field.nearest // field.nearest.shape[1]) ** 2 + (cols - field.nearest % field.nearest.shape[1]) ** 2
    return np.where(field.nearest >= 0, squares, -1)


def assert_nearest(field: SurfaceField, grid: OccupancyGrid) -> None:
    occupied = grid.log_odds > 0.0
    assert occupied.reshape(-1)[field.nearest[field.nearest >= 0]].all()
    held = held_distances(field)
    np.testing.assert_array_equal(held, squared_distances(occupied))
    np.testing.assert_array_equal(field.squares, np.where(held < 0, field.radius**2 + 1, held))


def empty_grid(geometry: GridGeometry) -> OccupancyGrid:
    """A map in which every cell that turns occupied has been hit once, in its middle."""
    grid = OccupancyGrid.empty(geometry)
    grid.hit_count[:] = 1.0
    return grid


cells = st.lists(st.integers(0, WIDTH * HEIGHT - 1), unique=True, max_size=12)


@settings(max_examples=150)
@given(st.lists(st.tuples(cells, cells), min_size=1, max_size=6))
def test_the_nearest_surface_is_the_nearest_after_any_comings_and_goings(steps: list[tuple[list[int], list[int]]]) -> None:
    grid = empty_grid(GridGeometry(1.0, WIDTH, HEIGHT))
    field = SurfaceField(grid, REACH)
    for come, gone in steps:
        grid.log_odds.reshape(-1)[gone], grid.log_odds.reshape(-1)[come] = -1.0, 1.0
        field.update(grid, np.array(sorted({*come, *gone}), np.int64))
        assert_nearest(field, grid)


@given(cells)
def test_a_fresh_field_holds_the_nearest_surfaces(occupied: list[int]) -> None:
    grid = empty_grid(GridGeometry(1.0, WIDTH, HEIGHT))
    grid.log_odds.reshape(-1)[occupied] = 1.0
    assert_nearest(SurfaceField(grid, REACH), grid)


@given(cells, st.integers(0, 5), st.integers(0, 5), st.integers(0, 5), st.integers(0, 5))
def test_a_grown_field_is_the_field_of_the_grown_map(occupied: list[int], below: int, left: int, above: int, right: int) -> None:
    small = empty_grid(GridGeometry(0.5, WIDTH, HEIGHT, SE2(1.0, 2.0)))
    small.log_odds.reshape(-1)[occupied] = 1.0
    corner = SE2(1.0 - 0.5 * left, 2.0 - 0.5 * below)
    large = empty_grid(GridGeometry(0.5, WIDTH + left + right, HEIGHT + below + above, corner))
    window = slice(below, below + HEIGHT), slice(left, left + WIDTH)
    large.log_odds[window] = small.log_odds
    field, fresh = SurfaceField(small, 2.0), SurfaceField(large, 2.0)
    field.grow(large, (below, left))
    np.testing.assert_allclose(field.surfaces, fresh.surfaces, atol=1e-5)
    np.testing.assert_array_equal(held_distances(field), held_distances(fresh))
    assert field.T_grid_map == fresh.T_grid_map


@settings(max_examples=40)
@given(cells, cells, st.integers(0, 5), st.integers(0, 5))
def test_a_grown_field_follows_later_changes(before: list[int], after: list[int], below: int, left: int) -> None:
    small = empty_grid(GridGeometry(1.0, WIDTH, HEIGHT))
    small.log_odds.reshape(-1)[before] = 1.0
    field = SurfaceField(small, REACH)
    large = empty_grid(GridGeometry(1.0, WIDTH + left, HEIGHT + below, SE2(-float(left), -float(below))))
    large.log_odds[below:, left:] = small.log_odds
    field.grow(large, (below, left))
    turned = (np.array(after, np.int64) // WIDTH + below) * (WIDTH + left) + np.array(after, np.int64) % WIDTH + left
    large.log_odds.reshape(-1)[turned] = np.where(large.log_odds.reshape(-1)[turned] > 0.0, -1.0, 1.0)
    field.update(large, turned)
    assert_nearest(field, large)


@pytest.mark.parametrize("offset", [0.0, 0.013, 0.025, 0.037, 0.0499])
@pytest.mark.parametrize("slope", [0.0, 0.3, 1.0, 4.0])
def test_the_surface_of_a_wall_is_the_wall(make_grid: MakeGrid, slope: float, offset: float) -> None:
    normal = np.array([-slope, 1.0]) / np.hypot(slope, 1.0)
    along = np.linspace(-3.0, 3.0, 6001)[:, None] * [normal[1], -normal[0]]
    grid = make_grid(along + offset * normal, GridGeometry(0.05, 40, 40, SE2(-1.0, -1.0)))
    field = SurfaceField(grid)
    surfaces = field.surfaces[grid.log_odds > 0.0]
    middle = surfaces[(np.abs(surfaces[:, [X, Y]] - 1.0) < 0.6).all(axis=1)].astype(np.float64)
    assert (middle[:, FLATNESS] > 0.0).all()
    np.testing.assert_allclose(np.abs(middle[:, [NORMAL_X, NORMAL_Y]] @ normal), 1.0, atol=1e-5)
    np.testing.assert_allclose((middle[:, [X, Y]] - 1.0) @ normal, offset, atol=1e-4)


def test_normals_turn_with_the_grid(make_grid: MakeGrid) -> None:
    wall = np.column_stack([np.full(2001, 0.52), np.linspace(-1.0, 1.0, 2001)])
    T_map_grid = SE2(-1.2, 0.1, -0.6)
    grid = make_grid(wall, GridGeometry(0.05, 50, 50, T_map_grid))
    surfaces = SurfaceField(grid).surfaces[grid.log_odds > 0.0].astype(np.float64)
    inner = surfaces[(surfaces[:, FLATNESS] > 0.0)]
    np.testing.assert_allclose(T_map_grid.transform(inner[:, [X, Y]])[:, 0], 0.52, atol=1e-4)
    np.testing.assert_allclose(np.abs(inner[:, [NORMAL_X, NORMAL_Y]] @ T_map_grid.rotation().T)[:, 0], 1.0, atol=1e-4)


def test_a_lone_hit_is_a_point_at_its_hit(make_grid: MakeGrid) -> None:
    grid = make_grid(np.array([[0.513, 0.491]]), GridGeometry(0.05, 20, 20))
    surface = SurfaceField(grid).surfaces[9, 10]
    np.testing.assert_allclose(surface, [0.513, 0.491, 0.0, 0.0, 0.0], atol=1e-6)


def test_a_round_clump_is_no_line(make_grid: MakeGrid) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    grid = make_grid(0.5 + 0.06 * np.column_stack([np.cos(turn), np.sin(turn)]), GridGeometry(0.05, 20, 20))
    assert not SurfaceField(grid).surfaces[..., FLATNESS].any()


def test_the_field_of_an_empty_map_has_no_surface() -> None:
    field = SurfaceField(OccupancyGrid.empty(GridGeometry(0.05, 5, 5)))
    assert (field.nearest == -1).all()
