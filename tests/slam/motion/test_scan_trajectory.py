import numpy as np

from slam.motion.scan_trajectory import ScanTrajectory
from slam.se2 import SE2


def test_poses_come_back_in_order() -> None:
    path = ScanTrajectory()
    path.append(1.0, SE2(1.0))
    path.append(2.0, SE2(2.0))
    np.testing.assert_array_equal(path.trajectory().stamps, [1.0, 2.0])
    np.testing.assert_array_equal(path.trajectory().poses[:, 0], [1.0, 2.0])


def test_a_scan_with_its_predecessors_stamp_replaces_it() -> None:
    path = ScanTrajectory()
    path.append(1.0, SE2(1.0))
    path.append(1.0, SE2(2.0))
    assert len(path) == 1
    assert path.trajectory().poses[0, 0] == 2.0


def test_a_path_without_scans_is_an_empty_trajectory() -> None:
    assert len(ScanTrajectory().trajectory()) == 0
