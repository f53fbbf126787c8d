"""What lies between the robot and what it sees."""

from __future__ import annotations

import numpy as np
import pytest

from slam.kernels import sight
from slam.mapping.grid_mapper import GridMapper, MapSettings
from slam.se2 import SE2, FloatArray

WALL = np.column_stack([np.full(81, 1.02), np.linspace(-2.0, 2.0, 81)])
"""Hits on a wall across x, seen from the origin [m]."""


@pytest.fixture(scope="module")
def mapper() -> GridMapper:
    mapper = GridMapper(MapSettings())
    for _ in range(3):
        mapper.insert(SE2(), WALL, np.zeros_like(WALL))
    return mapper


def beams(mapper: GridMapper, start: tuple[float, float], end: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    return tuple(mapper.field.T_grid_map.transform(np.array([place])) for place in (start, end))  # pyright: ignore[reportReturnType]


@pytest.mark.parametrize(
    ("start", "end", "crosses"),
    [
        ((0.0, 0.0), (2.0, 0.5), True),
        ((2.0, 0.5), (0.0, 0.0), True),
        ((0.0, 0.0), (1.02, 0.5), False),
        ((0.0, 0.0), (1.10, 0.5), False),
        ((0.0, -1.0), (0.5, 1.0), False),
        ((0.98, -1.9), (1.06, 1.9), False),
        ((-50.0, 0.0), (50.0, 0.0), True),
    ],
)
def test_a_beam_pierces_a_wall_that_it_crosses_and_does_not_graze(
    mapper: GridMapper, start: tuple[float, float], end: tuple[float, float], crosses: bool
) -> None:
    assert bool(sight.pierced(*beams(mapper, start, end), mapper.field.arrays)[0]) == crosses


@pytest.mark.parametrize(("start", "behind"), [((0.0, 0.3), False), ((2.0, 0.3), True)])
def test_a_wall_is_known_from_one_side(mapper: GridMapper, start: tuple[float, float], behind: bool) -> None:
    assert bool(sight.from_behind(*beams(mapper, start, (1.03, 0.3)), mapper.field.arrays, 0.1)[0]) == behind


def test_a_hit_far_from_every_wall_is_behind_none(mapper: GridMapper) -> None:
    assert not sight.from_behind(*beams(mapper, (2.0, 0.3), (1.3, 0.3)), mapper.field.arrays, 0.1)[0]
