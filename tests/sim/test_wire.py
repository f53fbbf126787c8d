import math
import socket
import time

import ev3_dc as ev3
import numpy as np
import pytest

from hardware.emulators.channels import TcpChannel
from hardware.emulators.ev3_brick import BeaconSender, Ev3Brick
from hardware.emulators.port import Port
from hardware.protocols.ev3_direct import Beacon
from sim.kinematic import Kinematic
from sim.wire import WiredTwin, Wiring, on_the_wire
from slam.se2 import SE2
from worlds.loader import load_world


class HandClock:
    """Goes on by hand: no machine is too busy for it."""

    def __init__(self):
        self.now = 5000.0

    def __call__(self):
        return self.now

    def go_on(self, seconds):
        self.now += seconds


def wired(clock):
    return WiredTwin(Kinematic(world="hall", realism=on_the_wire("ideal")), clock)


@pytest.fixture
def clock():
    return HandClock()


@pytest.fixture
def twin(clock):
    with wired(clock) as twin:
        yield twin


def free_port() -> int:
    """A free port of four digits: the independent client knows no other."""
    for port in range(5600, 9999):
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)):
                return port
    pytest.skip("no free port")


def test_the_realism_of_the_wire_keeps_what_was_asked_for():
    assert on_the_wire("harsh:drive.regulator=0").startswith("harsh:drive.regulator=0,")
    assert on_the_wire("ideal").startswith("ideal:")


def test_it_turns_its_wheels_as_told_and_stands_without_a_watchdog(twin, clock):
    start = twin.angle_deg(0)
    twin.turn(0, 30)
    twin.turn(3, 30)
    clock.go_on(0.8)
    assert twin.angle_deg(0) - start > 150.0
    assert twin.angle_deg(1) == 0.0
    twin.release(0)
    twin.turn(3, 0)
    clock.go_on(0.3)
    rest = twin.angle_deg(3)
    clock.go_on(0.1)
    assert twin.angle_deg(3) == pytest.approx(rest, abs=0.1)


def test_its_gyro_counts_clockwise(twin, clock):
    twin.turn(0, -20)
    twin.turn(3, 20)
    clock.go_on(0.6)
    (angle_deg,), (rate_deg,) = twin.sense(3, 0), twin.sense(3, 1)
    assert rate_deg == pytest.approx(-20 * 10.07 * 28.0 / 60.0, abs=3.0)
    assert angle_deg < -20.0


def test_every_turn_of_the_lidar_comes_once_and_in_order(twin, clock):
    turns = []
    for _ in range(100):
        clock.go_on(0.01)
        twin.angle_deg(0)  # waits for the present, as taking a turn does not
        turn = twin.next_turn()
        turns += [turn] if turn is not None else []
    assert len(turns) >= 8
    assert np.diff([turn.stamp for turn in turns]) == pytest.approx([0.1] * (len(turns) - 1), abs=1e-6)
    assert len(turns[0].ranges_mm) == 682


def test_a_machine_that_is_too_slow_is_told_of_and_the_twin_still_answers(twin, clock, caplog):
    clock.go_on(3.0)
    assert twin.angle_deg(0) == pytest.approx(0.0)
    assert twin.simulation.now < 2.9
    assert "too busy for real time" in caplog.text
    for _ in range(3):
        twin.angle_deg(0)
    assert twin.simulation.now == pytest.approx(3.0)


def test_a_twin_is_wired_as_it_is_told(clock):
    wiring = Wiring(left=2, right=1, gyro=1, reversed=True)
    with WiredTwin(Kinematic(world="hall", realism=on_the_wire("ideal")), clock, wiring) as twin:
        assert (twin.motors(), list(twin.sensors())) == ((2, 1), [1])
        for output in twin.motors():
            twin.turn(output, -30.5)
        clock.go_on(0.8)
        assert twin.angle_deg(2) < -150.0
        assert (SE2(*load_world("hall").start).inverse() @ twin.pose(clock.now)).x > 0.05


def test_the_truth_is_told_once_at_times_of_the_host(twin, clock):
    clock.go_on(0.2)
    twin.pose(clock.now)
    first, second = twin.new_truth(), twin.new_truth()
    assert first.stamps[-1] == pytest.approx(clock.now, abs=0.011)
    assert not set(first.stamps) & set(second.stamps)


@pytest.mark.wall_clock
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_independent_client_drives_it():
    with wired(time.monotonic) as twin, Port(Ev3Brick(twin), TcpChannel(port=free_port())) as port:
        beacon = BeaconSender(Beacon("0016530a0b0c", int(port.address.rpartition(":")[2])), period=0.1)
        beacon.open()
        brick = ev3.EV3(protocol=ev3.WIFI, host="00:16:53:0A:0B:0C")
        beacon.close()
        assert brick.sensors.Port_4 == ev3.EV3_GYRO
        vehicle = ev3.TwoWheelVehicle(0.028, 0.120, ev3_obj=brick, port_left=ev3.PORT_A, port_right=ev3.PORT_D)
        driven = []
        for task in (lambda: vehicle.drive_straight(0.2), lambda: vehicle.drive_turn(90, 0.0)):
            start = twin.pose(time.monotonic())
            task().start(thread=False)
            time.sleep(0.3)
            driven.append(start.inverse() @ twin.pose(time.monotonic()))
        brick._physical_ev3._socket.close()
    assert driven[0].x == pytest.approx(0.2, rel=0.01)
    assert math.degrees(driven[1].yaw) == pytest.approx(90.0, rel=0.015)
