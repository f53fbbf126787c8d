import math
from typing import Any

import numpy as np
import pytest

from slam.matching.localizability import Localizability
from slam.se2 import SE2

ALL_ROUND = np.linspace(-math.pi, math.pi, 720, endpoint=False)


@pytest.mark.parametrize("yaw", [0.0, 0.4, -1.2, 3.0])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_corridor_is_unknown_along_its_axis(make_walls: Any, noise: float, yaw: float) -> None:
    walls = make_walls([(-30.0, 0.66, 30.0, 0.66), (-30.0, -0.66, 30.0, -0.66)])
    angles = np.concatenate([np.linspace(0.3, 2.8, 300), np.linspace(-2.8, -0.3, 300)])
    points = walls.points(SE2(0.0, 0.1), np.random.default_rng(0).normal(0.0, noise, 600), angles)
    turned = SE2(yaw=yaw).inverse().transform(points)
    found = Localizability.of(turned, SE2(5.0, 2.0, 0.5 + yaw))
    assert found.weakest > 0.05
    assert found.strongest < 0.002
    assert math.remainder(found.axis - 0.5, math.pi) == pytest.approx(0.0, abs=0.02)


def test_the_end_of_a_corridor_makes_it_known(make_walls: Any) -> None:
    walls = make_walls([(-30.0, 0.66, 3.0, 0.66), (-30.0, -0.66, 3.0, -0.66), (3.0, -0.66, 3.0, 0.66)])
    points = walls.points(SE2(), np.random.default_rng(0).normal(0.0, 0.01, 600), np.linspace(-2.0, 2.0, 600))
    assert Localizability.of(points, SE2()).weakest < 0.01


def test_a_round_room_is_unknown_in_heading() -> None:
    circle = 2.0 * np.column_stack([np.cos(ALL_ROUND), np.sin(ALL_ROUND)])
    noisy = circle * (1.0 + np.random.default_rng(0).normal(0.0, 0.0025, (720, 1)))
    found = Localizability.of(noisy, SE2())
    assert found.weakest < 0.002
    assert found.heading > 0.006


def test_a_room_is_known(room: Any) -> None:
    found = Localizability.of(room.points(SE2(), np.random.default_rng(0).normal(0.0, 0.01, 682)), SE2())
    assert found.weakest < 0.003
    assert found.heading < math.radians(0.1)


def test_the_order_of_the_points_does_not_matter(room: Any) -> None:
    points = room.points(SE2(), np.random.default_rng(0).normal(0.0, 0.01, 682))
    shuffled = np.random.default_rng(1).permutation(points)
    assert Localizability.of(shuffled, SE2()).weakest == pytest.approx(Localizability.of(points, SE2()).weakest, rel=0.2)


def test_the_bound_is_that_of_the_normals() -> None:
    """Two walls at right angles, each straight on: sigma / sqrt(beams)."""
    side = np.linspace(-0.05, 0.05, 100)
    rng = np.random.default_rng(3)
    points = np.vstack(
        [np.column_stack([0.9 + rng.normal(0.0, 0.01, 100), side]), np.column_stack([side[::-1], 0.9 + rng.normal(0.0, 0.01, 100)])]
    )
    found = Localizability.of(points, SE2())
    assert found.weakest == pytest.approx(0.001, rel=0.4)


@pytest.mark.parametrize("points", [np.empty((0, 2)), np.ones((1, 2)), np.full((9, 2), np.nan), np.zeros((30, 2))])
def test_nothing_is_known_of_nothing(points: np.ndarray) -> None:
    found = Localizability.of(points, SE2())
    assert found.weakest == math.inf
    assert found.heading == math.inf
