import math

import numpy as np
import pytest

from scripts.experiments.arena import errors_in, follow, mae, map_of, rmse, start_in
from scripts.experiments.drive import Course
from slam.evaluation.poses import transform
from slam.mapping.lidar import Lidar
from slam.messages import Trajectory
from slam.se2 import SE2


@pytest.fixture(scope="module")
def drive():
    return Course("aruco_room", 8.0, 3).drive()


@pytest.fixture(scope="module")
def given(drive):
    return map_of(drive, Lidar().build(SE2(1.0, 2.0, 0.5)))


def test_a_map_is_placed_where_its_run_says(drive, given):
    walls = given.T_world_map.transform(given.known.grid.wall_points())
    assert np.abs(walls).max() < 10.0
    assert start_in(given, drive).as_array() == pytest.approx([1.0, 2.0, 0.5], abs=0.03)


def test_errors_are_those_in_the_axes_of_the_world(drive, given):
    off = Trajectory(drive.truth.stamps, drive.truth.poses + np.array([0.03, -0.01, math.tau + 0.2]))
    errors = errors_in(given, drive, Trajectory(off.stamps, transform(given.T_world_map.inverse(), off.poses)))
    np.testing.assert_allclose(errors.x, 0.03, atol=1e-9)
    np.testing.assert_allclose(errors.y, -0.01, atol=1e-9)
    np.testing.assert_allclose(errors.yaw, 0.2, atol=1e-9)
    assert rmse(errors.position) == pytest.approx(math.hypot(0.03, 0.01))
    assert mae(errors.where(errors.stamps > 4.0).y) == pytest.approx(0.01)


def test_a_pipeline_is_followed_frame_by_frame(drive):
    seen = []
    outcome = follow(Lidar().build(), drive, lambda frame, estimate, snapshot: seen.append(estimate.stamp))
    assert seen == [frame.stamp for frame in drive.frames] == list(outcome.estimate.stamps)
    assert len(outcome.statuses) == len(seen)
    assert len(outcome.final) == len(drive.scans) == len(outcome.update_ms)
