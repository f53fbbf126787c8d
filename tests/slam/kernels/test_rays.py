import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.kernels.rays import cast, empty_squares, short_direction

ROOM = """
##########
#....#...#
#....#...#
#........#
#..##....#
#..##....#
#........#
##########
"""
OCCUPIED = np.array([[cell == "#" for cell in row] for row in ROOM.split()])[::-1]
SQUARES = empty_squares(OCCUPIED)


def entered(occupied, x, y, heading):
    """Distance at which a ray enters the first occupied cell, by clipping it to every one of them [cells]."""
    rows, cols = np.nonzero(occupied)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        across = np.sort((np.stack([cols, cols + 1]) - x) / math.cos(heading), axis=0)
        along = np.sort((np.stack([rows, rows + 1]) - y) / math.sin(heading), axis=0)
    enters, leaves = np.maximum(across[0], along[0]), np.minimum(across[1], along[1])
    hit = (enters <= leaves) & (leaves >= 0.0)
    return max(float(enters[hit].min()), 0.0) if hit.any() else math.inf


def test_a_square_is_the_largest_that_is_empty():
    height, width = OCCUPIED.shape
    padded = np.pad(OCCUPIED, 1, constant_values=True)
    for quadrant, (across, along) in enumerate([(-1, -1), (1, -1), (-1, 1), (1, 1)]):
        for row in range(height + 2):
            for col in range(width + 2):
                side = 0
                while not padded[np.ix_(row + along * np.arange(side + 1), col + across * np.arange(side + 1))].any():
                    side += 1
                assert SQUARES[quadrant, row, col] == side


@given(st.floats(0.01, 9.99), st.floats(0.01, 7.99), st.floats(-10.0, 10.0))
def test_a_ray_ends_where_it_enters_an_occupied_cell(x, y, heading):
    (distance,) = cast(SQUARES, np.array([[0.05 * x, 0.05 * y, heading]]), 0.05, 5.6)
    near = [entered(OCCUPIED, x + dx, y + dy, heading) for dx in (-1e-9, 0.0, 1e-9) for dy in (-1e-9, 0.0, 1e-9)]
    assert min(near) - 1e-6 <= distance / 0.05 <= max(near) + 1e-6  # through a corner either way is right


@pytest.mark.parametrize("quarter", range(-3, 6))
def test_rays_along_the_axes_are_exact(quarter):
    heading = quarter * math.pi / 2
    (distance,) = cast(SQUARES, np.array([[2.3, 2.6, heading]]), 1.0, 99.0)
    assert distance == pytest.approx({0: 0.7, 1: 4.4, 2: 1.3, 3: 1.6}[quarter % 4], abs=1e-12)


def test_headings_are_right_to_a_billionth_all_round():
    headings = np.linspace(-20.0, 20.0, 4001)
    squares = empty_squares(np.pad(np.zeros((199, 199), bool), 1, constant_values=True))
    ranges = cast(squares, np.column_stack([np.full((4001, 2), 100.5), headings]), 1.0, 999.0)
    x, y = ranges * np.cos(headings), ranges * np.sin(headings)
    assert np.maximum(np.abs(x), np.abs(y)) == pytest.approx(99.5, abs=1e-9)


def test_what_is_beyond_the_reach_is_infinite():
    ray = np.array([[2.3, 2.6, 0.0]])
    assert cast(SQUARES, ray, 1.0, 0.69) == [math.inf]
    assert cast(SQUARES, ray, 1.0, 0.71) == pytest.approx([0.7])


def test_a_ray_that_leaves_the_grid_or_starts_beside_it_meets_nothing():
    squares = empty_squares(np.zeros((4, 5), bool))
    rays = np.array([[2.0, 2.0, 0.3], [2.0, 2.0, -2.0], [-0.5, 2.0, 0.0], [9.0, 2.0, math.pi], [math.nan, 0.0, 0.0]])
    assert np.all(np.isinf(cast(squares, rays, 1.0, 99.0)))


def test_inside_an_occupied_cell_the_distance_is_zero():
    assert cast(SQUARES, np.array([[3.5, 2.5, 1.0]]), 1.0, 99.0) == [0.0]


def test_squares_larger_than_a_byte_lose_nothing():
    occupied = np.zeros((3, 700), bool)
    occupied[1, 690] = True
    wide = empty_squares(np.tile(occupied, (200, 1)))
    assert cast(wide, np.array([[1.5, 301.5, 0.0]]), 1.0, 999.0) == pytest.approx([688.5])


def test_the_short_series_of_cosine_and_sine_are_right_to_single_precision():
    yaws = np.linspace(-20.0, 20.0, 4001)
    found = np.array([short_direction(yaw) for yaw in yaws])
    assert np.abs(found - np.column_stack([np.cos(yaws), np.sin(yaws)])).max() < 5e-7
