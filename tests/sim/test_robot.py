import math

import numpy as np
import pytest

from hardware.errors import NotOpenError, SpecError
from hardware.spec import RobotSpec
from sim.errors import SimError
from sim.ground_truth import ground_truth
from sim.robot import Sim
from slam.messages import Twist
from worlds.errors import WorldError
from worlds.parts import Box


def drive(robot, twist, duration, dt=0.1):
    """Frames of a constant command."""
    frames, end = [], robot.clock.now() + duration
    while robot.clock.now() < end - 1e-9:
        robot.drive(twist)
        robot.clock.sleep_until(min(robot.clock.now() + dt, end))
        frames.append(robot.read())
    return frames


def odometry_error(robot, twists):
    """Distance [m] and heading [rad] between odometry and truth after a drive, and the way driven [m]."""
    truth = ground_truth(robot)
    start, frames = truth.pose(0.0), []
    for twist, duration in twists:
        frames += drive(robot, twist, duration)
    last = frames[-1].odometry[-1]
    error = last.T_odom_base.inverse() @ start.inverse() @ truth.pose(last.stamp)
    return math.hypot(error.x, error.y), error.yaw


CIRCLES = [(Twist(0.2, 0.8), 6.0), (Twist(0.2, -0.8), 6.0), (Twist(0.0, 1.5), 2.0), (Twist(-0.2, 0.3), 1.0)]


def test_odometry_of_an_ideal_body_is_right():
    with Sim(realism="ideal").build() as robot:
        distance, heading = odometry_error(robot, CIRCLES)
    assert distance < 0.005
    assert abs(heading) < math.radians(1.0)


def test_odometry_of_the_default_body_is_off_by_its_drive_errors():
    with Sim().build() as robot:
        _, heading = odometry_error(robot, [(Twist(0.25, 0.0), 4.0)])
        truth = ground_truth(robot)
        way = abs((truth.pose(0.0).inverse() @ truth.pose(4.0)).x)
    assert heading == pytest.approx(-way * (0.005 + 0.003) / (0.12 * 1.01), rel=0.05)


def test_the_ideal_body_drives_as_commanded(room_file):
    with Sim(world=room_file(), realism="ideal").build() as robot:
        drive(robot, Twist(0.2, 0.5), 3.0)
        a, b = ground_truth(robot).pose(2.0), ground_truth(robot).pose(3.0)
    assert (a.inverse() @ b).log() == pytest.approx([0.2, 0.0, 0.5], rel=0.01, abs=1e-3)


def test_a_wall_stops_the_robot(room_file):
    with Sim(world=room_file(start=(1.5, 0.0, 0.0))).build() as robot:
        drive(robot, Twist(0.3, 0.0), 4.0)
        pose = ground_truth(robot).pose(4.0)
    assert 1.85 < pose.x < 1.95
    assert abs(pose.y) < 0.1


def test_a_movable_body_is_pushed_and_seen_where_it_is(room_file):
    world = room_file(boxes=(Box((0.5, 0.0), (0.2, 0.2, 0.3), mass=0.5),))
    with Sim(world=world, realism="ideal").build() as robot:
        frames = drive(robot, Twist(0.2, 0.0), 4.0)
        pose = ground_truth(robot).pose(4.0)
    front = frames[-1].scans[-1]
    assert 0.6 < pose.x < 0.85
    assert front.ranges[340] == pytest.approx(0.05, abs=0.01)


def test_both_ray_casters_give_the_same_scan(room_file):
    world = room_file(boxes=(Box((1.0, 0.5), (0.2, 0.3, 0.3), yaw=0.3),))
    scans = {}
    for rays in ("embree", "bullet"):
        with Sim(world=world, realism="ideal", rays=rays).build() as robot:
            scans[rays] = drive(robot, Twist(0.2, 1.0), 0.5)[-1].scans[-1]
    difference = np.abs(scans["embree"].ranges - scans["bullet"].ranges)
    assert np.mean(difference <= 0.0011) > 0.995


def test_a_robot_without_lidar_and_gyro_has_neither():
    with Sim(spec=RobotSpec(lidar=None, imu=None)).build() as robot:
        frames = drive(robot, Twist(0.1, 0.0), 0.5)
    assert all(frame.available == {"odometry"} and not frame.scans and not frame.imu for frame in frames)


def test_the_noise_of_one_sensor_does_not_depend_on_the_other():
    readings = []
    for spec in (RobotSpec(), RobotSpec(lidar=None)):
        with Sim(spec=spec, seed=4).build() as robot:
            readings.append([reading for frame in drive(robot, Twist(), 0.5) for reading in frame.imu])
    assert [a.yaw_rate for a in readings[0]] == pytest.approx([b.yaw_rate for b in readings[1]], abs=1e-4)


def test_readings_do_not_depend_on_how_the_sleep_is_cut():
    finals = []
    for dt in (0.007, 0.05):
        with Sim(seed=1).build() as robot:
            frames = []
            while robot.clock.now() < 0.35:
                robot.clock.sleep_until(robot.clock.now() + dt)
                frames.append(robot.read())
            finals.append([scan.ranges.tobytes() for frame in frames for scan in frame.scans][:2])
    assert finals[0] == finals[1]
    assert len(finals[0]) == 2


def test_a_full_queue_is_counted():
    with Sim(spec=RobotSpec(lidar=None), realism="ideal").build() as robot:
        robot.clock.sleep_until(45.0)
        assert robot.health().dropped == 4501 - 4096
        assert len(robot.read().imu) == 4096


def test_two_twins_do_not_disturb_each_other():
    with Sim(seed=2).build() as alone:
        expected = drive(alone, Twist(0.2, 0.3), 0.5)
    with Sim(seed=2).build() as robot, Sim(seed=3, world="corridor").build() as other:
        frames = []
        for _ in range(5):
            frames += drive(robot, Twist(0.2, 0.3), 0.1)
            drive(other, Twist(-0.1, 1.0), 0.1)
    assert frames[-1].scans[-1].ranges.tobytes() == expected[-1].scans[-1].ranges.tobytes()
    assert frames[-1].odometry == expected[-1].odometry


def test_readings_from_before_a_reset_are_gone():
    with Sim().build() as robot:
        robot.clock.sleep_until(1.0)
        robot.reset(1)
        frame = robot.read()
    assert (frame.odometry, frame.imu, frame.scans) == ((), (), ())


@pytest.mark.parametrize("wrong", [{"realism": "perfect"}, {"rays": "laser"}, {"seed": -1}])
def test_a_wrong_parameter_names_what_is_allowed(wrong):
    with pytest.raises(SimError, match=r"available|or above"):
        Sim(**wrong)


def test_an_unknown_world_is_an_error_when_opened():
    with pytest.raises(WorldError, match="aruco_room"):
        Sim(world="aruco_rom").build().open()


def test_a_robot_without_a_drive_cannot_be_simulated():
    with pytest.raises(SpecError, match="drive"):
        Sim(spec=RobotSpec(drive=None)).build().open()


def test_reset_needs_an_open_robot():
    with pytest.raises(NotOpenError):
        Sim().build().reset(0)


def test_time_must_be_finite():
    with Sim().build() as robot, pytest.raises(SimError, match="finite"):
        robot.clock.sleep_until(math.inf)
