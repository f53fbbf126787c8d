import math
from dataclasses import replace

import numpy as np
import pytest

from slam.localization.amcl import Amcl
from slam.localization.augmentation import Augmentation, Averages
from slam.localization.belief import Belief, Filtering
from slam.localization.mcl import Mcl
from slam.localization.motion_models import OdometryMotion
from slam.localization.particles import Particles
from slam.localization.resampling import Kld
from slam.localization.sensor_models import LikelihoodField
from slam.messages import LaserScan, SensorFrame, Status, WheelOdometry
from slam.scans import PointScan
from slam.se2 import SE2

START, TWIST = SE2(-0.8, -0.7, 0.4), np.array([0.25, 0.0, 0.35])
ANGLES = np.linspace(-2.0, 2.0, 341)
BODY = frozenset({"odometry", "scans"})


def truth(t):
    return START @ SE2.exp(TWIST * t)


def frames(room, seconds=2.0, available=BODY):
    rng, made = np.random.default_rng(4), []
    for k in range(round(10 * seconds)):
        ranges = room.ranges(truth(0.1 * k), ANGLES) + rng.normal(0.0, 0.01, len(ANGLES))
        wheels = tuple(WheelOdometry(t, SE2.exp(TWIST * [1.02, 1.0, 1.03] * t)) for t in (0.1 * k - 0.04, 0.1 * k))
        scan = LaserScan(0.1 * k, ranges, ANGLES, 0.0, 0.02, 5.6)
        made.append(SensorFrame(0.1 * k, wheels if "odometry" in available else (), (), (scan,), available))
    return made


def off_at_end(pipeline, drive):
    estimate = [pipeline.update(frame) for frame in drive][-1]
    off = truth(drive[-1].stamp).inverse() @ estimate.T_map_base
    return math.hypot(off.x, off.y), abs(off.yaw), estimate


@pytest.mark.parametrize(
    "settings", [Amcl(), Amcl(motion_model="velocity"), Amcl(sensor_model="beam", filtering=Filtering(beams=60)), Amcl(polish=False), Mcl()]
)
def test_the_pose_is_found_from_a_start_that_is_a_little_off(settings, room, room_map):
    distance, turn, estimate = off_at_end(settings.build(room_map, START @ SE2(0.08, -0.06, 0.08)), frames(room))
    exact = isinstance(settings, Amcl) and settings.polish
    assert distance < (0.015 if exact else 0.05)
    assert turn < (0.01 if exact else 0.03)
    assert estimate.status == Status.TRACKING


@pytest.mark.parametrize("start", [None, SE2(1.1, 0.62, 0.0), SE2(30.0, 0.0, 0.0)])
def test_a_start_that_is_not_known_or_cannot_be_is_looked_for(start, room, room_map):
    distance, turn, estimate = off_at_end(Amcl().build(room_map, start), frames(room))
    assert distance < 0.03
    assert turn < 0.03
    assert estimate.status == Status.TRACKING


def test_without_wheels_the_pose_is_tracked_and_the_lack_is_named(room, room_map):
    distance, _, estimate = off_at_end(Amcl().build(room_map, START), frames(room, available=frozenset({"scans"})))
    assert distance < 0.03
    assert estimate.status == Status.DEGRADED
    assert "no wheel odometry" in estimate.reason


def test_somebody_who_stands_around_the_robot_moves_it_nowhere(room, room_map):
    pipeline, drive = Amcl().build(room_map, START), frames(room, 5.0)
    hidden = [replace(scan, ranges=np.minimum(scan.ranges, 0.12)) for frame in drive[20:28] for scan in frame.scans]
    drive[20:28] = [replace(frame, scans=(scan,)) for frame, scan in zip(drive[20:28], hidden, strict=True)]
    for frame in drive:
        estimate, T = pipeline.update(frame), truth(frame.stamp)
        assert math.hypot(estimate.T_map_base.x - T.x, estimate.T_map_base.y - T.y) < 0.08
        assert ("the scan shows nothing" in estimate.reason) == (20 <= round(10 * frame.stamp) < 28)
    assert estimate.status == Status.TRACKING


def test_the_covariance_covers_the_error(room, room_map):
    squares = []
    for seed in range(5):
        drive = frames(room)
        pipeline = Amcl(seed=seed).build(room_map, START)
        for frame in drive:
            estimate = pipeline.update(frame)
            T = truth(frame.stamp)
            error = np.array([estimate.T_map_base.x - T.x, estimate.T_map_base.y - T.y, (T.inverse() @ estimate.T_map_base).yaw])
            squares.append(error @ np.linalg.solve(estimate.covariance, error))
    assert np.mean(np.array(squares) < 11.34) > 0.9


def test_the_particles_shown_are_those_that_the_newest_update_has_weighed(room, room_map):
    pipeline = Amcl().build(room_map, START)
    for frame in frames(room, 1.0):
        pipeline.update(frame)
    particles = pipeline.snapshot().particles
    assert particles.shape[1] == 4
    assert particles[:, 3].sum() == pytest.approx(1.0)
    assert np.ptp(particles[:, 3]) > 0.0


def test_a_fixed_number_of_particles_stays(room_map):
    rng = np.random.default_rng(1)
    particles = Particles.about(START, np.diag([0.01, 0.01, 0.01]), 300, rng)
    belief = Belief(Filtering(sample_size=Kld(300, 300), resample_below=1.0), room_map, particles, rng)
    points = np.array([[1.0, 0.2], [0.5, -1.0], [-0.4, 0.9]])
    for _ in range(3):
        likelihood = LikelihoodField().over(room_map, 5.6)
        belief.update(OdometryMotion(), (SE2(0.05), 0.1), likelihood, PointScan(0.0, points, np.zeros((3, 2))))
        assert len(belief.particles) == 300


def test_only_a_likelihood_that_falls_quickly_asks_for_random_poses():
    averages = Averages(Augmentation(0.001, 0.1))
    for _ in range(50):
        averages.add(0.8)
    assert averages.share == 0.0
    for _ in range(30):
        averages.add(0.2)
    assert 0.6 < averages.share < 0.76


def test_random_poses_are_drawn_only_in_doubt(room_map):
    rng = np.random.default_rng(1)
    belief = Belief(Filtering(), room_map, Particles.about(START, np.diag([1e-4] * 3), 500, rng), rng)
    belief.averages.slow, belief.averages.fast = 0.8, 0.2
    likelihood, cloud = LikelihoodField().over(room_map, 5.6), PointScan(0.0, np.array([[1.0, 0.2]]), np.zeros((1, 2)))
    far = []
    for doubtful in (False, True):
        belief.doubtful = doubtful
        belief.update(OdometryMotion(), (SE2(0.05), 0.1), likelihood, cloud)
        far.append(int((np.hypot(belief.particles.poses[:, 0] - START.x, belief.particles.poses[:, 1] - START.y) > 0.5).sum()))
    assert far[0] == 0
    assert far[1] > 150
