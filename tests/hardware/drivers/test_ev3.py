import math
import time

import numpy as np
import pytest

from hardware.drivers import ev3_link
from hardware.drivers.brick_driver import BrickReports
from hardware.drivers.errors import DeviceError, LinkError
from hardware.drivers.ev3 import PERCENT_RATE, Ev3Driver, Ev3Ports, Ev3Session
from hardware.drivers.ev3_link import Ev3Link
from hardware.drivers.orders import Orders
from hardware.drivers.transport import HidTransport
from hardware.drivers.wheel_counter import BrickState
from hardware.emulators.channels import PtyChannel, TcpChannel
from hardware.emulators.ev3_brick import BeaconSender, Ev3Brick
from hardware.emulators.port import Port
from hardware.protocols.ev3_direct import Beacon
from hardware.queues import EventQueue
from hardware.spec import DriveSpec, RobotSpec
from sim.motor_kernel import PERCENT_RATE as TWINS_PERCENT
from slam.messages import Twist

SPEC = RobotSpec()
DRIVE = DriveSpec()
pytestmark = [pytest.mark.wall_clock, pytest.mark.filterwarnings("default::ResourceWarning")]


class Bench:
    """A driver on a wire to an emulated brick."""

    def __init__(self, port, ports=None):
        self.port = port
        self.queues = EventQueue(), EventQueue()
        self.readings = self.queues[0].subscribe()
        self.rates = self.queues[1].subscribe()
        self.commands = EventQueue()
        self.orders = Orders(DRIVE, PERCENT_RATE, self.commands)
        self.driver = Ev3Driver(port.address, ports or Ev3Ports(), SPEC, self.orders, self.queues)

    def __enter__(self):
        self.driver.open()
        return self

    def __exit__(self, *exc):
        self.driver.close()

    def run(self, twist, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.orders.give(twist, time.monotonic())
            time.sleep(0.02)
        return self.readings.take()


def until(condition, seconds=4.0):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)
    return condition()


@pytest.fixture(params=["tcp", "serial"])
def port(request, rollers, tmp_path):
    channel = TcpChannel() if request.param == "tcp" else PtyChannel(tmp_path / "ev3")
    with Port(Ev3Brick(rollers, wifi=request.param == "tcp"), channel) as port:
        yield port


class FakeHid:
    """hidapi over an emulated brick: reports of 1024 bytes, the first byte of a sent one is its number."""

    def __init__(self, brick):
        self.brick = brick
        self.closed = False

    def write(self, buff):
        assert len(buff) == 1025
        assert buff[0] == 0
        end = 3 + int.from_bytes(buff[1:3], "little")
        self.answer = self.brick.exchange(bytes(buff[1:end]))
        return len(buff)

    def read(self, max_length, timeout_ms=0):
        end = time.monotonic() + timeout_ms * 1e-3
        while not self.answer and time.monotonic() < end:
            time.sleep(0.001)
            self.brick.tick()
            self.answer = self.brick.exchange(b"")
        report, self.answer = self.answer, b""
        return list(report.ljust(max_length, b"\x55")) if report else []

    def close(self):
        self.closed = True


def test_one_percent_is_the_same_for_driver_and_twin():
    assert pytest.approx(TWINS_PERCENT) == PERCENT_RATE


def test_it_drives_and_reports(port, rollers):
    with Bench(port) as bench:
        rollers.rate_deg = -20.0
        readings = bench.run(Twist(0.1, 0.0), 1.0)
        assert bench.driver.state.volts == pytest.approx(7.9)
        assert bench.rates.take()[-1].yaw_rate == pytest.approx(math.radians(20.0))
    assert readings[0].T_odom_base.x == pytest.approx(0.0, abs=1e-9)
    assert readings[-1].T_odom_base.x == pytest.approx(0.09, abs=0.02)
    assert readings[-1].wheel_angles[0] == pytest.approx(readings[-1].T_odom_base.x / DRIVE.wheel_radii[0], rel=0.02)
    assert np.all(np.diff([reading.stamp for reading in readings]) > 0.0)
    assert until(lambda: rollers.percents == [0, 0, 0, 0])


def test_it_drives_over_usb(rollers):
    device = FakeHid(Ev3Brick(rollers, wifi=False))
    queues, orders = (EventQueue(), EventQueue()), Orders(DRIVE, PERCENT_RATE, EventQueue())
    session = Ev3Session(Ev3Link(HidTransport(device)), Ev3Ports(), SPEC, orders, BrickReports(*queues, BrickState()))
    end = time.monotonic() + 0.6
    while time.monotonic() < end:
        orders.give(Twist(0.1, 0.0), time.monotonic())
        session.step()
    assert queues[0].latest.T_odom_base.x > 0.02
    session.close()
    assert device.closed
    assert until(lambda: device.brick.tick() or rollers.percents == [0, 0, 0, 0])


def test_a_reversed_drive_counts_and_turns_the_other_way(port, rollers):
    with Bench(port, Ev3Ports(left="D", right="A", reversed=True)) as bench:
        readings = bench.run(Twist(0.1, 0.0), 0.5)
        assert rollers.percents[0] < 0
    assert readings[-1].T_odom_base.x > 0.02


def test_the_wheels_stop_when_the_caller_falls_silent(port, rollers):
    with Bench(port) as bench:
        bench.run(Twist(0.2, 0.0), 0.5)
        assert rollers.percents[0] > 0
        assert until(lambda: rollers.percents == [0, 0, 0, 0], 1.2)
        assert bench.commands.latest.twist == Twist()


def test_the_brick_stops_the_wheels_when_the_link_is_silent(port, rollers):
    with Bench(port) as bench:
        bench.run(Twist(0.35, 0.0), 1.0)
        assert rollers.percents[0] > 60
        port.silent = True
        silent = time.monotonic()
        assert until(lambda: rollers.percents == [0, 0, 0, 0], 2.0)
        assert time.monotonic() - silent < 0.6


def test_it_is_back_after_a_replug_and_its_odometry_goes_on(port, rollers, caplog):
    with Bench(port) as bench:
        before = bench.run(Twist(0.1, 0.0), 0.4)[-1]
        port.unplug()
        assert until(lambda: not bench.driver.link)
        assert until(lambda: rollers.percents == [0, 0, 0, 0])
        port.replug()
        replugged = time.monotonic()
        assert until(lambda: bench.driver.link)
        assert time.monotonic() - replugged < 2.0
        after = bench.run(Twist(), 0.3)
    assert after
    assert 0.0 <= after[0].T_odom_base.x - before.T_odom_base.x < 0.1
    assert "trying to find it again" in caplog.text


def test_a_brick_that_counts_anew_makes_no_jump(port, rollers):
    with Bench(port) as bench:
        rollers.angles = [9000.0] * 4
        assert until(lambda: bench.run(Twist(), 0.1))
        rollers.angles = [0.0] * 4
        assert until(lambda: bench.run(Twist(), 0.1))
        readings = bench.run(Twist(), 0.2)
    assert readings[-1].T_odom_base.x == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("disturb", [lambda answer: answer[:-3], lambda answer: b"\xff" * len(answer), lambda answer: b"\x00" + answer])
def test_garbage_is_no_reading(port, disturb):
    with Bench(port) as bench:
        bench.run(Twist(), 0.1)
        port.disturbed = disturb
        for reading in bench.run(Twist(), 0.8):
            assert reading.T_odom_base.x == 0.0
        port.disturbed = bytes
        now = time.monotonic()
        assert until(lambda: bench.queues[0].latest.stamp > now, 5.0)


def test_a_wheel_that_is_held_is_stalled(port, rollers):
    with Bench(port) as bench:
        bench.run(Twist(0.1, 0.0), 0.6)
        assert not bench.driver.state.stalled
        rollers.turn(0, rollers.percents[0])
        rollers.angles = [rollers.angle_deg(k) for k in range(4)]
        rollers.jammed = True
        assert until(lambda: bench.run(Twist(0.1, 0.0), 0.1) and bench.driver.state.stalled)


def test_a_gyro_that_is_not_there_is_an_error_that_names_its_port(port, rollers):
    rollers.plugged = {}
    with pytest.raises(DeviceError, match=r"input 4 has type 126 .* needed; plug"):
        Bench(port).driver.open()


def test_a_motor_that_is_not_there_is_an_error_that_names_its_port(port):
    with pytest.raises(DeviceError, match="output B has type 126"):
        Bench(port, Ev3Ports(left="B")).driver.open()


@pytest.mark.parametrize("ports", [{"left": "E"}, {"left": "A", "right": "A"}, {"gyro": 5}, {"left": ""}])
def test_impossible_ports_are_an_error(ports):
    with pytest.raises(DeviceError, match="impossible ports"):
        Ev3Ports(**ports)


@pytest.mark.parametrize("address", ["tcp:127.0.0.1:9", "/nonexistent/port", "tcp:127.0.0.1:x", "", "tcp:no.such.host.invalid"])
def test_a_brick_that_is_not_there_is_an_error_with_a_remedy(address):
    with pytest.raises(DeviceError, match=";") as caught:
        ev3_link.connect(address)
    assert "\n" not in str(caught.value)


def test_something_else_on_the_port_is_no_brick():
    class Other:
        def attach(self):
            pass

        def tick(self):
            pass

        def exchange(self, received):
            return b"HTTP/1.0 400 no\r\n" if received else b""

    with Port(Other(), TcpChannel()) as port, pytest.raises(LinkError, match="no EV3"):
        ev3_link.connect(port.address)


def test_a_brick_is_found_by_its_beacon(rollers):
    with Port(Ev3Brick(rollers), TcpChannel()) as port:
        sender = BeaconSender(Beacon("001653000001", int(port.address.rpartition(":")[2])), period=0.1)
        sender.open()
        try:
            link = ev3_link.connect("wifi:001653000001")
            link.close()
        finally:
            sender.close()
