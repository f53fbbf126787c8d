import time

import pytest

from hardware.emulators.channels import TcpChannel
from hardware.emulators.ev3_brick import Ev3Brick
from hardware.emulators.port import Port
from hardware.errors import HardwareError, SpecError
from hardware.ev3_robot import BLIND_TIME, Ev3
from hardware.spec import RobotSpec
from sim.kinematic import Kinematic
from slam.messages import Twist

pytestmark = pytest.mark.wall_clock
FORWARD = Twist(0.1, 0.0)


@pytest.fixture
def port(rollers):
    with Port(Ev3Brick(rollers), TcpChannel()) as port:
        yield port


@pytest.fixture
def robot(port):
    with Ev3(ev3=port.address, lidar="").build() as robot:
        yield robot


def keep_driving(robot, seconds):
    end = robot.clock.now() + seconds
    while robot.clock.sleep_until(robot.clock.now() + 0.04) and robot.clock.now() < end:
        commanded = robot.drive(FORWARD)
    return commanded


def test_its_spec_is_the_twins_but_for_the_gyros_rate():
    real, twin = Ev3(camera="usb").spec, Kinematic(camera="raster").spec
    assert (real.drive, real.lidar, real.camera, real.T_base_camera) == (twin.drive, twin.lidar, twin.camera, twin.T_base_camera)
    assert Ev3().spec.camera is None
    assert real.imu.period == real.drive.period
    assert Ev3(lidar="").spec.lidar is None


def test_a_robot_without_wheels_is_an_error():
    with pytest.raises(SpecError, match="wheels"):
        Ev3(spec=RobotSpec(drive=None))


def test_it_does_not_drive_on_an_empty_battery(robot, rollers):
    assert robot.drive(FORWARD).v > 0.0
    rollers.volts = 6.0
    assert keep_driving(robot, 0.3) == Twist()
    assert robot.health().battery_volts == pytest.approx(6.0)
    assert rollers.percents == [0, 0, 0, 0]


def test_it_gives_up_on_a_wheel_that_is_held_until_it_is_told_to_stand(robot, rollers):
    rollers.jammed = True
    assert keep_driving(robot, 1.8) == Twist()
    assert robot.health().stalled or rollers.percents == [0, 0, 0, 0]
    rollers.jammed = False
    robot.drive(Twist())
    robot.clock.sleep_until(robot.clock.now() + 0.2)
    assert robot.drive(FORWARD).v > 0.0


def test_an_emergency_stop_lasts_until_it_is_opened_anew(robot, rollers):
    keep_driving(robot, 0.3)
    robot.stop_at_once()
    assert keep_driving(robot, 0.2) == Twist()
    assert robot.health().emergency_stop
    assert rollers.percents == [0, 0, 0, 0]
    robot.close()
    robot.open()
    assert robot.drive(FORWARD).v > 0.0


def test_it_does_not_drive_blind(emulate):
    brick, lidar = emulate()
    with Ev3(ev3=brick, lidar=lidar).build() as robot:
        assert keep_driving(robot, 0.4).v > 0.0
        robot._lidar.close()
        robot._scans.latest = None
        robot._opened = time.monotonic() - BLIND_TIME - 0.1
        assert robot.drive(FORWARD) == Twist()
        assert not robot.health().link


def test_a_lidar_that_is_missing_leaves_the_brick_alone(port, rollers):
    with pytest.raises(HardwareError, match="cannot connect"):
        Ev3(ev3=port.address, lidar="tcp:127.0.0.1:9").build().open()
    assert rollers.percents == [0, 0, 0, 0]


@pytest.mark.parametrize("t", [float("nan"), float("inf")])
def test_nobody_sleeps_until_a_time_that_is_none(robot, t):
    with pytest.raises(HardwareError, match="finite"):
        robot.clock.sleep_until(t)
