import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hardware.camera_spec import d435
from hardware.spec import LidarSpec, RobotSpec
from sim.errors import SimError
from sim.ground_truth import ground_truth
from sim.kinematic import Kinematic
from sim.robot import Sim
from slam.messages import Twist
from slam.se3 import SE3
from worlds.parts import Box, Cylinder

WITHOUT = """
import sys
for module in ("pybullet", "embreex"):
    sys.modules[module] = None
from hardware.registry import backend_class
from sim.ground_truth import ground_truth
from slam.messages import Twist

with backend_class("kinematic")().build() as robot:
    robot.drive(Twist(0.2, 0.5))
    robot.clock.sleep_until(0.4)
    frame = robot.read()
assert len(frame.scans) == 3 and ground_truth(robot).pose(0.4).x != 0.0
"""
SMALL_CAMERA = RobotSpec(lidar=None, camera=d435((424, 240), (424, 240)))


def drive(robot, twists, dt=0.1):
    """Frames of commands (twist, duration)."""
    frames = []
    for twist, duration in twists:
        for _ in range(round(duration / dt)):
            robot.drive(twist)
            robot.clock.sleep_until(round(robot.clock.now() + dt, 9))
            frames.append(robot.read())
    return frames


def test_it_runs_without_pybullet_and_without_embree():
    subprocess.run([sys.executable, "-c", WITHOUT], check=True, cwd=Path(__file__).parents[2])


NEEDED = """
import sys
sys.modules["pybullet"] = None
from scripts.cli import main
sys.exit(main(["run", "--robot", "sim"]))
"""


def test_the_physics_says_what_it_needs_and_what_would_do(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    refused = subprocess.run([sys.executable, "-c", NEEDED], check=False, capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert refused.returncode == 2
    assert refused.stderr == "twin: the robot 'sim' needs PyBullet: pip install pybullet, or take the robot 'kinematic'\n"


def test_the_same_commands_lead_to_the_same_place_as_in_the_physics(room_file):
    twists = [(Twist(0.2, 0.9), 3.0), (Twist(0.2, -0.7), 3.0), (Twist(0.0, 1.5), 2.0), (Twist(-0.15, 0.3), 2.0)]
    ends = []
    for twin in (Kinematic, Sim):
        with twin(world=room_file(), realism="ideal").build() as robot:
            drive(robot, twists)
        ends.append(np.array([ground_truth(robot).pose(t).as_array() for t in np.linspace(0.0, 10.0, 101)]))
    difference = ends[0] - ends[1]
    assert np.hypot(difference[:, 0], difference[:, 1]).max() <= 0.02
    assert np.abs(np.remainder(difference[:, 2] + math.pi, math.tau) - math.pi).max() <= math.radians(1.0)


def test_unequal_wheels_bend_its_way_as_they_do_in_the_physics(room_file):
    realism = "ideal:drive.radius_left=0.005,drive.radius_right=-0.003,drive.track=0.01"
    with Kinematic(world=room_file(start=(-1.5, 0.0, 0.0)), realism=realism).build() as robot:
        frames = drive(robot, [(Twist(0.25, 0.0), 4.0)])
        pose = ground_truth(robot).pose(4.0)
    assert frames[-1].odometry[-1].T_odom_base.yaw == 0.0
    assert pose.yaw == pytest.approx(-1.0 * 0.008 / (0.12 * 1.01), rel=0.03)


def test_odometry_of_an_ideal_body_is_right_to_a_count():
    with Kinematic(realism="ideal").build() as robot:
        last = drive(robot, [(Twist(0.2, 0.8), 4.0), (Twist(0.2, -0.8), 4.0)])[-1].odometry[-1]
        truth = ground_truth(robot)
        error = last.T_odom_base.inverse() @ truth.pose(0.0).inverse() @ truth.pose(last.stamp)
    assert math.hypot(error.x, error.y) < 0.003
    assert abs(error.yaw) < math.radians(0.5)


@pytest.mark.parametrize("obstacle", ["wall", "box that could be pushed", "column"])
def test_it_stops_where_its_circle_touches_and_turns_on(obstacle, room_file):
    contents = {
        "wall": {"start": (1.5, 0.0, 0.0)},
        "box that could be pushed": {"start": (0.0, 0.0, 0.0), "boxes": (Box((0.6, 0.0), (0.2, 0.4, 0.3), mass=0.5),)},
        "column": {"start": (0.0, 0.0, 0.0), "cylinders": (Cylinder((0.6, 0.0), 0.1, 1.0),)},
    }[obstacle]
    edge = 2.0 if obstacle == "wall" else 0.5
    with Kinematic(world=room_file(**contents), realism="ideal").build() as robot:
        frames = drive(robot, [(Twist(0.2, 0.0), 3.5)])
        touching = ground_truth(robot).pose(3.5)
        drive(robot, [(Twist(0.0, 1.0), 1.0), (Twist(-0.1, 0.0), 2.0)])
        away = ground_truth(robot).pose(6.5)
    assert touching.x == pytest.approx(edge - robot.spec.radius, abs=0.001)
    assert frames[-1].odometry[-1].T_odom_base.x > 0.6  # the wheels slip
    assert away.yaw == pytest.approx(1.0, abs=0.12)
    assert away.x < touching.x - 0.05


def test_a_table_top_is_no_obstacle_and_a_box_lower_than_the_lidar_is(room_file):
    boxes = (Box((0.8, 0.0), (0.4, 2.0, 0.03), z=0.7), Box((1.6, 0.0), (0.1, 2.0, 0.1)))
    with Kinematic(world=room_file(boxes=boxes), realism="ideal").build() as robot:
        drive(robot, [(Twist(0.3, 0.0), 6.0)])
        assert ground_truth(robot).pose(6.0).x == pytest.approx(1.55 - 0.13, abs=0.001)


@pytest.mark.parametrize("rays", ["embree", "grid"])
def test_a_body_that_could_be_pushed_is_seen(rays, room_file):
    world = room_file(boxes=(Box((1.0, 0.0), (0.2, 0.4, 0.3), mass=1.0),))
    with Kinematic(world=world, realism="ideal", rays=rays).build() as robot:
        scan = drive(robot, [(Twist(), 0.3)])[-1].scans[-1]
    assert scan.ranges[340] == pytest.approx(0.9 - 0.03, abs=0.6e-3)


def test_both_ray_casters_give_the_same_scans_with_all_errors():
    scans = {}
    for rays in ("embree", "grid"):
        with Kinematic(rays=rays, seed=3).build() as robot:
            scans[rays] = [scan.ranges for frame in drive(robot, [(Twist(0.2, 0.8), 1.0)]) for scan in frame.scans]
    same = np.isclose(scans["embree"], scans["grid"], atol=0.0011, equal_nan=True)
    assert same.mean() > 0.99


def test_any_lidar_sees_with_grid_rays_what_it_sees_with_embree():
    scans = {}
    tilted = LidarSpec(T_base_laser=SE3.from_xyz_rpy((0.0, 0.0, 0.18), (math.pi, 0.04, 0.1)))
    for rays in ("embree", "grid"):
        with Kinematic(spec=RobotSpec(lidar=tilted), rays=rays, realism="ideal").build() as robot:
            scans[rays] = drive(robot, [(Twist(), 0.2)])[-1].scans[-1].ranges
    assert np.mean(np.isclose(scans["embree"], scans["grid"], atol=0.0011)) > 0.99


def test_its_camera_sees_what_the_physics_camera_sees(room_file):
    world = room_file(boxes=(Box((1.2, 0.0), (0.2, 0.4, 0.3), mass=1.0),))
    pictures = []
    for twin in (Kinematic, Sim):
        with twin(world=world, realism="ideal", camera="raster", spec=SMALL_CAMERA).build() as robot:
            pictures.append([image for frame in drive(robot, [(Twist(), 0.15)]) for image in frame.images][-1])
    colours = [picture.colour.astype(np.float64) for picture in pictures]
    assert pictures[0].stamp == pictures[1].stamp
    assert np.median(np.abs(colours[0] - colours[1])) <= 2.0


@pytest.mark.parametrize("wrong", [{"realism": "perfect"}, {"rays": "bullet"}, {"camera": "tiny"}, {"seed": -1}])
def test_a_wrong_parameter_names_what_is_allowed(wrong):
    with pytest.raises(SimError, match=r"available|or above"):
        Kinematic(**wrong)
