import itertools
import math
import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from hardware.bricks import make_brick
from hardware.drivers import ev3dev_server
from hardware.drivers.brick_driver import Ev3Ports
from hardware.drivers.errors import DeviceError, LinkError
from hardware.emulators.channels import TcpChannel
from hardware.emulators.ev3dev_tree import Ev3devTree
from hardware.emulators.port import Port
from hardware.emulators.relay import Relay
from hardware.ev3_robot import Ev3
from hardware.queues import EventQueue
from hardware.spec import RobotSpec
from slam.messages import Twist

pytestmark = pytest.mark.wall_clock
SERVER = Path(ev3dev_server.__file__)
FULL = Twist(0.35, 0.0)


@pytest.fixture
def tree(rollers, tmp_path):
    with Ev3devTree(rollers, tmp_path / "class"):
        yield tmp_path / "class"


@pytest.fixture
def server(tree):
    """The real server on the emulated files; its address and its process."""
    command = [sys.executable, "-S", str(SERVER), "--root", str(tree), "--host", "127.0.0.1", "--port", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    yield "ev3dev:" + process.stdout.readline().split()[-1], process
    process.kill()
    process.communicate()


def driver_at(address, ports=None, spec=None):
    queues = EventQueue(), EventQueue()
    return make_brick(address, ports or Ev3Ports(), spec or RobotSpec(), EventQueue(), queues), [queue.subscribe() for queue in queues]


def drive(orders, twist, seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        commanded = orders.give(twist, time.monotonic())
        time.sleep(0.02)
    return commanded


def test_it_drives_as_told_and_says_what_it_did(server, rollers):
    driver, (odometry, imu) = driver_at(server[0])
    rollers.rate_deg = 30.0
    with Closing(driver):
        drive(driver.orders, Twist(0.1, 0.0), 1.2)
        readings, rates = odometry.take(), imu.take()
    assert readings[-1].T_odom_base.x == pytest.approx(0.1 * 1.1, abs=0.03)
    assert rates[-1].yaw_rate == pytest.approx(-math.radians(30.0))
    assert driver.state.volts == pytest.approx(7.9)
    assert all(a.stamp < b.stamp for a, b in itertools.pairwise(readings))


class Closing:
    def __init__(self, driver):
        self.driver = driver

    def __enter__(self):
        self.driver.open()

    def __exit__(self, *exc):
        self.driver.close()


def rest(rollers, since):
    while any(rollers.percents) and time.monotonic() - since < 3.0:
        time.sleep(0.01)
    return time.monotonic() - since


def test_wheels_come_to_rest_by_themselves_when_the_client_dies(server, rollers, tmp_path):
    code = "import sys,time\nfrom hardware.ev3_robot import Ev3\nfrom slam.messages import Twist\n"
    code += f"with Ev3(ev3={server[0]!r}, lidar='').build() as robot:\n  while True:\n    robot.drive(Twist(0.35, 0.0)); time.sleep(0.02)\n"
    client = subprocess.Popen([sys.executable, "-c", code], cwd=Path(__file__).parents[3])
    end = time.monotonic() + 20.0
    while rollers.percents[0] < 60 and time.monotonic() < end:
        time.sleep(0.02)
    assert rollers.percents[0] >= 60
    os.kill(client.pid, signal.SIGKILL)
    killed = time.monotonic()
    client.wait()
    assert 0.2 < rest(rollers, killed) < 0.7  # 0.6 s of its own, and the emulated files' beat on a busy machine


def test_wheels_come_to_rest_when_the_client_only_falls_silent(server, rollers):
    with socket.create_connection(("127.0.0.1", int(server[0].rpartition(":")[2]))) as client:
        client.sendall(b"ports A D 4\n500 500\n")
        time.sleep(0.05)
        assert rest(rollers, time.monotonic()) < 0.7


def test_the_newest_client_is_listened_to_and_a_lost_server_is_found_again(server, tree, rollers):
    driver, (odometry, _) = driver_at(server[0])
    with Closing(driver):
        with socket.create_connection(("127.0.0.1", int(server[0].rpartition(":")[2]))) as rival:
            rival.sendall(b"ports A D 4\n")
            assert rival.recv(64) == b"ok *DA\n"
        end = time.monotonic() + 5.0
        while driver.losses == 0 and time.monotonic() < end:
            time.sleep(0.02)
        odometry.take()
        while not odometry.take() and time.monotonic() < end:
            time.sleep(0.02)
        assert driver.link


def test_the_robot_composes_it(server):
    with Ev3(ev3=server[0], lidar="").build() as robot:
        commanded = robot.drive(Twist(0.1, 0.5))
        assert commanded.v == pytest.approx(0.1, abs=0.001)  # whole degrees a second are finer than whole percent
        robot.clock.sleep_until(robot.clock.now() + 0.2)
        assert robot.read().odometry
        assert robot.health().battery_volts == pytest.approx(7.9)


@pytest.mark.parametrize("ports", [Ev3Ports("B", "D"), Ev3Ports(gyro=2)])
def test_what_is_not_plugged_in_is_an_error(server, ports):
    driver, _ = driver_at(server[0], ports)
    with pytest.raises(DeviceError, match="nothing is plugged into"):
        driver.open()


def test_a_brick_without_a_server_is_an_error():
    driver, _ = driver_at("ev3dev:127.0.0.1:9")
    with pytest.raises(LinkError, match="cannot connect"):
        driver.open()


@pytest.mark.parametrize("line", [b"\n", b"1 2\n", b"ports\n", b"ports A D x\n", b"\xff\xfe\n", b"ports A D 4 5\n", b"go go\n"])
def test_what_is_no_question_is_answered_with_an_error(server, line):
    with socket.create_connection(("127.0.0.1", int(server[0].rpartition(":")[2]))) as client:
        client.sendall(line)
        assert client.recv(200).startswith(b"error")


def test_the_server_is_python_of_the_brick():
    """Python 3.5: nothing younger in it, and nothing but its standard library."""
    import ast

    tree = ast.parse(SERVER.read_text(), feature_version=(3, 5))
    imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    assert imported <= {"argparse", "os", "select", "socket", "sys", "time"}
    assert not any(isinstance(node, ast.JoinedStr | ast.AnnAssign | ast.ImportFrom | ast.NamedExpr) for node in ast.walk(tree))


def test_half_an_answer_is_no_reading(server, rollers):
    """Between driver and server something bites off the begin of an answer: what is left looks like one."""

    rollers.angles = [7654.0] * 4
    relay = Relay("127.0.0.1", int(server[0].rpartition(":")[2]))
    with closing(relay), Port(relay, TcpChannel()) as port:
        driver, (odometry, _) = driver_at(f"ev3dev:{port.address.removeprefix('tcp:')}")
        with Closing(driver):
            port.disturbed = lambda answer: answer[1:]
            end = time.monotonic() + 5.0
            while driver.losses == 0 and time.monotonic() < end:
                time.sleep(0.02)
            port.disturbed = bytes
            while not driver.link and time.monotonic() < end:
                time.sleep(0.02)
            assert driver.losses > 0
            assert driver.link
    assert all(reading.T_odom_base.x == 0.0 for reading in odometry.take())
