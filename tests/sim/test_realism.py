import math
from dataclasses import fields

import pytest

from hardware.errors import SpecError
from hardware.spec import RobotSpec
from sim.errors import RealismError
from sim.ground_truth import ground_truth
from sim.realism import REALISMS, Realism, read_realism
from sim.robot import Sim
from slam.messages import Twist

GROUPS = [field.name for field in fields(Realism)]


@pytest.mark.parametrize("name", REALISMS)
def test_a_realism_is_read_by_its_name(name):
    assert read_realism(name) == REALISMS[name]


def test_ideal_has_no_errors():
    assert read_realism("ideal") == Realism()


@pytest.mark.parametrize("group", GROUPS)
def test_every_number_can_be_changed_by_its_name(group):
    for field in fields(getattr(Realism(), group)):
        changed = read_realism(f"harsh:{group}.{field.name}=0.25")
        assert getattr(getattr(changed, group), field.name) == 0.25
        assert read_realism(f"harsh:{group}.{field.name}={getattr(getattr(REALISMS['harsh'], group), field.name)}") == REALISMS["harsh"]


def test_several_numbers_are_changed_at_once():
    changed = read_realism("datasheet:lidar.range_sigma=0.02, commands.drop=0.1")
    assert (changed.lidar.range_sigma, changed.commands.drop) == (0.02, 0.1)
    assert changed.gyro == REALISMS["datasheet"].gyro


@pytest.mark.parametrize(
    ("text", "help_"),
    [
        ("perfect", "available: ideal, datasheet, harsh"),
        ("ideal:laser.range_sigma=1", "available: lidar, drive"),
        ("ideal:lidar.sigma=1", "available: range_sigma"),
        ("ideal:lidar.range_sigma", "must be a number"),
        ("ideal:lidar.range_sigma=much", "got 'much'"),
        ("ideal:lidar.range_sigma=nan", "must be a number"),
        ("ideal:range_sigma=1", "available: lidar, drive"),
        ("ideal:lidar.warm_up_time=0", "must be above 0"),
        ("ideal:drive.resistance=-1", "must be above 0"),
        ("ideal:imu.drop=1.5", "between 0 and 1"),
    ],
)
def test_a_wrong_realism_says_what_there_is(text, help_):
    with pytest.raises(RealismError, match=help_) as caught:
        Sim(realism=text)
    assert "\n" not in str(caught.value)


def test_the_true_body_differs_from_the_specified_one():
    true = read_realism("ideal:drive.radius_left=0.01,drive.track=0.02").true_spec(RobotSpec()).drive
    assert true.wheel_radii == pytest.approx((0.028 * 1.01, 0.028))
    assert true.track == pytest.approx(0.12 * 1.02)


def test_a_body_without_wheels_has_no_true_one():
    with pytest.raises(SpecError, match="drive"):
        Realism().true_spec(RobotSpec(drive=None))


@pytest.mark.parametrize("name", REALISMS)
def test_the_robot_stays_on_its_wheels_however_it_is_driven(name):
    with Sim(world="corridor", realism=name).build() as robot:
        heights = []
        for twist in (Twist(0.35, 0.0), Twist(), Twist(-0.35, 0.0), Twist(0.35, 0.0), Twist(0.0, 3.0), Twist(0.0, -3.0)):
            for _ in range(6):
                robot.drive(twist)
                robot.clock.sleep_until(robot.clock.now() + 0.1)
                rows, _ = robot.running.motion.poses_between(robot.clock.now() - 0.1, robot.clock.now())
                heights += [1.0 - 2.0 * (x * x + y * y) for x, y in rows[:, 3:5].tolist()]
    assert min(heights) > math.cos(math.radians(3.0))


def test_a_slippery_floor_makes_the_wheels_slip():
    ways = []
    for friction in (0.9, 0.02):
        with Sim(world="corridor", realism=f"ideal:drive.wheel_friction={friction}").build() as robot:
            robot.drive(Twist(0.3, 0.0))
            robot.clock.sleep_until(0.3)
            ways.append((ground_truth(robot).pose(0.0).inverse() @ ground_truth(robot).pose(0.3)).x)
    assert ways[1] < 0.7 * ways[0]


def test_the_battery_is_in_the_robots_health():
    with Sim().build() as robot:
        robot.clock.sleep_until(0.1)
        assert 7.0 < robot.health().battery_volts < 8.2
    with Sim(realism="ideal").build() as robot:
        assert robot.health().battery_volts is None
