import numpy as np
import pytest

from slam.errors import KnownMapError
from slam.grid import FREE, OCCUPIED, UNKNOWN, GridGeometry, OccupancyGrid
from slam.kernels.surfaces import FLATNESS, NORMAL_X, ONE_SIDED
from slam.localization.known_map import KnownMap
from slam.se2 import SE2


def grid_of(states):
    states = np.array(states, np.int8)
    return OccupancyGrid.from_states(GridGeometry(0.05, states.shape[1], states.shape[0]), states)


def two_rooms(thickness):
    """Free space left and right of a wall of so many cells."""
    states = np.full((20, 20), FREE)
    states[:, 10 : 10 + thickness] = OCCUPIED
    return grid_of(states)


def test_the_two_faces_of_a_wall_look_to_their_own_rooms():
    field = KnownMap(two_rooms(2)).field
    left, right = field.surfaces[10, 10], field.surfaces[10, 11]
    assert (left[FLATNESS], right[FLATNESS]) == (ONE_SIDED, ONE_SIDED)
    assert left[NORMAL_X] == pytest.approx(-1.0)
    assert right[NORMAL_X] == pytest.approx(1.0)
    assert left[0] == pytest.approx(0.5)  # where the free space ends
    assert right[0] == pytest.approx(0.6)


def test_a_wall_of_one_cell_is_seen_from_both_sides():
    field = KnownMap(two_rooms(1)).field
    assert field.surfaces[10, 10, FLATNESS] == 1.0


def test_free_places_are_centres_of_free_cells():
    states = np.full((2, 3), UNKNOWN)
    states[0, 0], states[1, 2] = OCCUPIED, FREE
    known = KnownMap(grid_of(states))
    np.testing.assert_array_equal(known.free_cells, [[1, 2]])
    np.testing.assert_allclose(known.free_points, [[0.125, 0.075]])


@pytest.mark.parametrize(("state", "what"), [(FREE, "no occupied cell"), (OCCUPIED, "no free cell")])
def test_a_map_in_which_nothing_can_be_localised_is_refused(state, what):
    with pytest.raises(KnownMapError, match=what):
        KnownMap(grid_of(np.full((3, 3), state)))


def test_points_on_walls_are_told_from_points_in_the_open():
    known = KnownMap(two_rooms(2))  # a wall from 0.5 to 0.6 m along x
    points = np.array([[0.15, 0.0], [0.05, 0.1], [-0.3, 0.0], [5.0, 0.0]])
    assert known.share_on_walls(SE2(0.4, 0.5), points) == 0.5
    assert known.share_on_walls(SE2(0.1, 0.5), points) == 0.0
    assert known.share_on_walls(SE2(), np.empty((0, 2))) == 0.0
