from typing import Any

import numpy as np
import pytest

from slam.grid import GridGeometry, OccupancyGrid
from slam.matching.correlative import Correlative
from slam.matching.surface_field import SurfaceField
from slam.se2 import SE2

SEARCH = Correlative()
PRIOR = np.diag([0.1**2, 0.1**2, 0.1**2])
TRUTH = SE2(0.2, -0.3, 0.4)
GEOMETRIES = [GridGeometry(0.05, 140, 140, SE2(-3.5, -3.5)), GridGeometry(0.05, 160, 160, SE2(-1.0, -4.2, 0.6))]


@pytest.fixture(scope="module", params=GEOMETRIES, ids=["straight", "turned"])
def field(request: pytest.FixtureRequest, room: Any, make_grid: Any) -> SurfaceField:
    return SurfaceField(make_grid(room.samples(), request.param))


@pytest.mark.parametrize("shift", [(0.25, 0.0, 0.0), (-0.2, 0.2, 0.0), (0.0, 0.0, 0.25), (0.15, -0.25, -0.2)])
def test_a_displaced_pose_is_found_within_a_lattice_step(room: Any, field: SurfaceField, shift: tuple[float, float, float]) -> None:
    off = TRUTH.inverse() @ SEARCH.search(field, room.points(TRUTH), TRUTH @ SE2(*shift), PRIOR)
    assert max(abs(off.x), abs(off.y)) < 0.06
    assert abs(off.yaw) < 0.03


def test_of_poses_that_fit_alike_the_guess_is_kept(make_walls: Any, make_grid: Any) -> None:
    walls = make_walls([(-3.4, 0.66, 3.4, 0.66), (-3.4, -0.66, 3.4, -0.66)])
    field = SurfaceField(make_grid(walls.samples(), GEOMETRIES[0]))
    found = SEARCH.search(field, walls.points(SE2(), angles=np.linspace(0.9, 2.2, 300)), SE2(0.07, 0.0, 0.0), PRIOR)
    assert found.x == pytest.approx(0.07, abs=1e-9)


def test_an_empty_map_keeps_the_guess() -> None:
    field = SurfaceField(OccupancyGrid.empty(GEOMETRIES[1]))
    off = TRUTH.inverse() @ SEARCH.search(field, np.ones((5, 2)), TRUTH, PRIOR)
    np.testing.assert_allclose(off.as_array(), 0.0, atol=1e-12)


def test_no_points_keep_the_guess(field: SurfaceField) -> None:
    assert SEARCH.search(field, np.empty((0, 2)), TRUTH, PRIOR) == TRUTH


def test_points_beyond_the_grid_are_survived(field: SurfaceField) -> None:
    found = SEARCH.search(field, np.full((5, 2), 50.0), TRUTH, PRIOR)
    np.testing.assert_allclose((TRUTH.inverse() @ found).as_array(), 0.0, atol=1e-12)


def test_a_dense_scan_is_thinned_to_the_same_answer(room: Any, field: SurfaceField) -> None:
    points = room.points(TRUTH)
    sparse = SEARCH.search(field, points, TRUTH @ SE2(0.1, 0.1, 0.1), PRIOR)
    dense = Correlative(beams=len(points)).search(field, points, TRUTH @ SE2(0.1, 0.1, 0.1), PRIOR)
    off = dense.inverse() @ sparse
    assert max(abs(off.x), abs(off.y), abs(off.yaw)) < 0.06
