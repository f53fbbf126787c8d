"""The server's own parts, in this process and without a network."""

import socket
import time

import pytest

from hardware.drivers.ev3dev_server import Brick, Client
from hardware.emulators.ev3dev_tree import Ev3devTree

pytestmark = pytest.mark.wall_clock


@pytest.fixture
def root(rollers, tmp_path):
    rollers.angles = [12.0, 0.0, 0.0, -7.0]
    rollers.rate_deg = 9.0
    with Ev3devTree(rollers, tmp_path / "class"):
        yield tmp_path / "class"


@pytest.fixture
def brick(root):
    return Brick(str(root))


def until(condition):
    end = time.monotonic() + 5.0
    while not condition() and time.monotonic() < end:
        time.sleep(0.005)
    return condition()


def test_it_tells_counters_gyro_battery_and_time(brick):
    assert brick.answer("ports A D 4") == "ok"
    assert until(lambda: brick.answer("0 0").split()[2] == "9")
    left, right, _, microvolts, time_us = brick.answer("0 0").split()
    assert (left, right, microvolts) == ("12", "-7", "7900000")
    assert int(time_us) == pytest.approx(1e6 * time.monotonic(), abs=1e6)


def test_it_turns_the_wheels_and_slows_them_down_when_nobody_asks(brick, rollers):
    brick.answer("ports A D 0")
    assert brick.answer("300 -300").split()[2] == "none"
    assert until(lambda: rollers.percents[0] > 25.0 and rollers.percents[3] < -25.0)
    asked = time.monotonic()
    while time.monotonic() < asked + 0.6:
        brick.watch()
        time.sleep(0.01)
    assert until(lambda: rollers.percents == [0, 0, 0, 0])


def test_it_brakes_at_its_end(brick, rollers):
    brick.answer("ports A D 0")
    brick.answer("200 200")
    assert until(lambda: rollers.percents[0] > 10.0)
    brick.stop()
    assert until(lambda: rollers.percents[0] == 0)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("0 0", "is not understood"),
        ("ports B D 4", "nothing is plugged into ev3-ports:outB"),
        ("ports A D 1", "nothing is plugged into ev3-ports:in1"),
        ("ports A D x", "invalid literal"),
    ],
)
def test_what_cannot_be_done_is_an_error(brick, line, words):
    assert words in brick.answer(line)


@pytest.mark.parametrize(("kind", "words"), [("tacho-motor/motor0", "no large motor"), ("lego-sensor/sensor3", "no gyro")])
def test_another_device_in_a_port_is_an_error(root, brick, kind, words):
    (root / kind / "driver_name").write_text("lego-ev3-m-motor\n")
    assert words in brick.answer("ports A D 4")


def test_a_client_is_answered_line_by_line_until_it_goes(brick):
    with socket.create_server(("127.0.0.1", 0)) as listener, socket.create_connection(listener.getsockname()) as ours:
        client = Client(listener.accept()[0])
        with client.link:
            converse(client, brick, ours)


def converse(client, brick, ours):
    ours.sendall(b"ports A D 0\nwhat")
    assert client.listen(brick)
    assert ours.recv(64) == b"ok *DA\n"
    ours.sendall(b" is this\n")
    assert client.listen(brick)
    assert ours.recv(64).startswith(b"error")
    ours.sendall(b"x" * 5000)
    while client.listen(brick):
        pass
    ours.close()
    assert not client.listen(brick)
