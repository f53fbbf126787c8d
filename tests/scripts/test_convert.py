import numpy as np
import pytest

from hardware.logs.registry import open_log
from hardware.recorder import Recorder
from hardware.urdf import urdf
from scripts.convert import main
from scripts.errors import UsageError
from sim.ground_truth import ground_truth
from sim.kinematic import Kinematic
from slam.messages import LaserScan, Twist, WheelOdometry


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Two seconds of the kinematic twin, with its truth."""
    folder = tmp_path_factory.mktemp("run")
    with Kinematic(seed=2).build() as robot, Recorder(robot, folder, urdf(robot.spec)) as recorder:
        truth = ground_truth(robot)
        for tick in range(50):
            robot.drive(Twist(0.2, 0.4))
            robot.clock.sleep_until(0.04 * (tick + 1))
            pose = truth.pose(robot.clock.now())
            recorder.add_truth(robot.clock.now(), pose.x, pose.y, pose.yaw)
            recorder.flush()
    return folder


def readings(path, kind):
    return [event.message for event in open_log(path).events() if isinstance(event.message, kind)]


@pytest.mark.parametrize("target", ["bag", "robot.bag", "robot.log"])
def test_the_readings_are_those_of_the_recording(recording, tmp_path, target):
    assert main([str(recording), str(tmp_path / target)]) == 0
    for kind, value in ((LaserScan, lambda scan: scan.ranges), (WheelOdometry, lambda reading: reading.T_odom_base.as_array())):
        before, after = readings(recording, kind), readings(tmp_path / target, kind)
        kept = {round(reading.stamp, 6): reading for reading in after}
        assert len(after) >= len(before)  # a CARMEN scan carries a pose of its own
        for reading in before:
            np.testing.assert_allclose(value(kept[round(reading.stamp, 6)]), value(reading), atol=1e-6)


def test_the_truth_goes_along_into_a_rosbag2(recording, tmp_path):
    main([str(recording), str(tmp_path / "bag")])
    truth, copied = open_log(recording).truth(), open_log(tmp_path / "bag").truth()
    np.testing.assert_array_equal(copied.stamps, truth.stamps)
    np.testing.assert_array_equal(copied.poses, truth.poses)


def test_a_log_of_a_recording_says_the_same_again(recording, tmp_path):
    main([str(recording), str(tmp_path / "a.log")])
    main([str(tmp_path / "a.log"), str(tmp_path / "bag")])
    main([str(tmp_path / "bag"), str(tmp_path / "b.log")])
    first, second = (readings(tmp_path / name, LaserScan) for name in ("a.log", "b.log"))
    np.testing.assert_allclose([scan.ranges for scan in first], [scan.ranges for scan in second])


@pytest.mark.parametrize(("target", "problem"), [("x.csv", "cannot write '.csv' recordings"), ("there.log", "is there already")])
def test_a_target_that_cannot_be_is_refused(recording, tmp_path, target, problem):
    (tmp_path / "there.log").touch()
    with pytest.raises(UsageError, match=problem):
        main([str(recording), str(tmp_path / target)])
