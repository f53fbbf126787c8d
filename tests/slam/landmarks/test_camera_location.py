import math

import numpy as np
import pytest

from scripts.bench.marker_scenes import MOUNT, MarkerScene
from slam.landmarks.camera_location import locate_camera, on_the_floor
from slam.landmarks.marker_location import MarkerField
from slam.landmarks.sighting import Sighting
from slam.se2 import SE2
from slam.se3 import SE3

SCENE = MarkerScene()
POSE = SE2(0.3, -0.4, 0.7)


def field_of(scene: MarkerScene) -> MarkerField:
    known = MarkerField.empty(MOUNT)
    for marker in scene.truth().markers.values():
        known.put(marker.id, marker.T_map_marker, marker.covariance)
    return known


def tilted(roll: float, pitch: float, z: float) -> tuple[SE3, list[Sighting]]:
    """A camera on a base that is not flat on the floor, and what it sees: the world is tilted the other way under a flat one."""
    T_map_base = SE3.from_xyz_rpy((POSE.x, POSE.y, z), (roll, pitch, POSE.yaw))
    moved = SCENE.truth().moved(SE3.from_se2(POSE) @ T_map_base.inverse())
    return T_map_base @ MOUNT, SCENE.sightings(POSE, np.random.default_rng(1), moved)


@pytest.mark.parametrize("near", [True, False])
@pytest.mark.parametrize(("roll", "pitch", "z"), [(0.0, 0.0, 0.0), (0.1, -0.08, 0.05)])
def test_the_camera_is_found_in_space_from_near_and_from_nothing(near: bool, roll: float, pitch: float, z: float) -> None:
    T_map_camera, sightings = tilted(roll, pitch, z)
    found = locate_camera(field_of(SCENE), sightings, SE3.from_se2(POSE) @ MOUNT if near else None)
    assert found is not None
    assert found.fits.all()
    off = (T_map_camera.inverse() @ found.T_map_camera).log()
    assert np.linalg.norm(off[:3]) < 0.005
    assert np.linalg.norm(off[3:]) < math.radians(0.2)
    assert off @ np.linalg.solve(found.covariance, off) < 30.0
    below = on_the_floor(found, MOUNT)
    assert math.hypot(below.T_map_base.x - POSE.x, below.T_map_base.y - POSE.y) < 0.005


def test_the_claimed_covariance_on_the_floor_covers_the_error() -> None:
    known, squares = field_of(SCENE), []
    for seed in range(40):
        sightings = SCENE.sightings(POSE, np.random.default_rng(seed))
        found = locate_camera(known, sightings, SE3.from_se2(POSE) @ MOUNT)
        assert found is not None
        location = on_the_floor(found, MOUNT)
        off = location.T_map_base.as_array() - POSE.as_array()
        squares.append(off @ np.linalg.solve(location.covariance, off))
    assert 1.5 < np.mean(squares) < 5.0


def test_a_wrong_marker_among_many_does_not_count() -> None:
    T_map_camera, sightings = tilted(0.05, 0.0, 0.0)
    known = field_of(SCENE)
    wrong = sightings[0].id
    known.put(wrong, SE3.from_xyz_rpy((0.3, 0.0, 0.0)) @ known.pose_of(wrong), np.zeros((6, 6)))
    found = locate_camera(known, sightings, None)
    assert found is not None
    assert found.fits.tolist() == [s.id != wrong for s in sightings]
    assert np.linalg.norm((T_map_camera.inverse() @ found.T_map_camera).t) < 0.006


def test_nothing_seen_tells_nothing() -> None:
    assert locate_camera(field_of(SCENE), [], None) is None
