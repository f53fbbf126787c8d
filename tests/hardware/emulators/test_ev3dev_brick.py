import socket

import pytest

from hardware.emulators.errors import EmulatorError
from hardware.emulators.ev3dev_brick import Ev3devBrick

pytestmark = pytest.mark.wall_clock


def ask(address, line):
    _, host, port = address.split(":")
    with socket.create_connection((host, int(port))) as client:
        client.sendall(line)
        return client.recv(200)


def test_its_server_answers_until_it_is_closed(rollers):
    with Ev3devBrick(rollers) as brick:
        assert ask(brick.address, b"ports A D 4\n") == b"ok *DA\n"
    brick.close()
    with pytest.raises(ConnectionError):
        ask(brick.address, b"ports A D 4\n")


def test_a_port_that_is_taken_is_an_error_and_holds_nothing(rollers):
    with Ev3devBrick(rollers) as brick:
        with pytest.raises(EmulatorError, match="in use; choose another port"):
            Ev3devBrick(rollers, "127.0.0.1", int(brick.address.rpartition(":")[2])).open()
        assert ask(brick.address, b"what\n").startswith(b"error")
