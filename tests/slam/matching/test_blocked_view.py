"""When a scan that does not fit speaks against the pose, and when it does not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from slam.mapping.grid_mapper import GridMapper, MapSettings
from slam.matching.blocked_view import blocked
from slam.matching.surface_field import SurfaceField
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray


@pytest.fixture
def corridor() -> SurfaceField:
    """Two walls along x, 2 m apart."""
    mapper = GridMapper(MapSettings())
    x = np.linspace(-3.0, 3.0, 400)
    points = np.vstack([np.column_stack([x, np.full(400, y)]) for y in (-1.0, 1.0)])
    for _ in range(4):
        mapper.insert(SE2(), points, np.zeros_like(points))
    return mapper.field


def seen_at(ranges: Any) -> PointScan:
    """A scan all around, from the origin of base."""
    angles = np.linspace(-np.pi, np.pi, 360, endpoint=False)
    points: FloatArray = np.broadcast_to(ranges, 360)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return PointScan(0.0, points, np.zeros_like(points))


def test_what_stands_before_the_walls_does_not_speak_against_the_pose(corridor: SurfaceField) -> None:
    assert blocked(seen_at(0.4), corridor, SE2(0.5, 0.2, 0.3))


def test_beams_that_end_beyond_known_walls_do(corridor: SurfaceField) -> None:
    assert not blocked(seen_at(2.5), corridor, SE2(0.5, 0.2, 0.3))


def test_where_nothing_is_known_nothing_does(corridor: SurfaceField) -> None:
    assert blocked(seen_at(2.5), corridor, SE2(30.0, 0.0, 0.0))
