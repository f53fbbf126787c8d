import numpy as np
import pytest

from slam.grid import FREE, OCCUPIED, UNKNOWN, GridGeometry, OccupancyGrid
from slam.localization.influence import localizability_matrix
from slam.localization.known_map import KnownMap
from slam.localization.map_faces import MapFaces
from slam.scans import PointScan
from slam.se2 import SE2

FRAME = SE2(-1.0, 2.0, 0.3)
LENGTH, WIDTH = 6.0, 2.0


def hall(open_ended=False):
    """A room whose inner walls are 1 to 7 m along and 1 to 3 m across in a grid that lies turned in the map."""
    states = np.full((80, 160), UNKNOWN)
    states[20:60, 20:140] = FREE
    states[[19, 60], 19:141] = OCCUPIED
    if not open_ended:
        states[19:61, [19, 140]] = OCCUPIED
    return KnownMap(OccupancyGrid.from_states(GridGeometry(0.05, 160, 80, FRAME), states.astype(np.int8)))


def scan_of(bearings):
    ends = np.column_stack([np.cos(bearings), np.sin(bearings)])
    return PointScan(0.0, ends, np.zeros_like(ends))


def test_ranges_are_those_to_the_walls_lines():
    pose = FRAME @ SE2(4.0, 2.0, 0.0)
    sight = MapFaces(hall()).look(pose, scan_of(np.array([0.0, np.pi / 2, np.pi / 4])), 10.0)
    half = 1.0 + 0.025  # the hits lie in the middle of the walls' cells
    np.testing.assert_allclose(sight.ranges, [3.025, half, half * np.sqrt(2.0)], atol=2e-3)
    np.testing.assert_allclose(sight.cosines, [1.0, 1.0, np.sqrt(0.5)], atol=1e-3)


@pytest.mark.parametrize("component", [0, 1, 2])
def test_gradients_are_those_of_the_ranges(component):
    faces, cloud = MapFaces(hall()), scan_of(np.array([0.1, 0.9, 1.7, -2.0, 3.0]))
    at = (FRAME @ SE2(3.7, 1.9, 0.4)).as_array()
    step = np.zeros(3)
    step[component] = 1e-4
    far, near = (faces.look(SE2.from_array(at + sign * step), cloud, 10.0).ranges for sign in (1.0, -1.0))
    gradients = faces.look(SE2.from_array(at), cloud, 10.0).gradients
    np.testing.assert_allclose(gradients[:, component], (far - near) / 2e-4, atol=1e-4)


def test_along_an_endless_corridor_nothing_is_known():
    cloud = scan_of(np.linspace(-2.0, 2.0, 200))
    faces, pose = MapFaces(hall(open_ended=True)), FRAME @ SE2(4.0, 1.8, 0.1)
    sight = faces.look(pose, cloud, 2.5)
    D = localizability_matrix(sight, np.where(np.isfinite(sight.ranges), 1e4, 0.0))
    along = np.array([np.cos(FRAME.yaw), np.sin(FRAME.yaw), 0.0])
    across = np.array([-np.sin(FRAME.yaw), np.cos(FRAME.yaw), 0.0])
    assert along @ D @ along < 1e-6 * (across @ D @ across)
