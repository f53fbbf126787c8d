"""Ways to a device that break: each error names the device and what helps."""

import errno
import socket
import sys
from types import SimpleNamespace

import pytest

from hardware.drivers import ev3_link
from hardware.drivers.errors import DeviceError, LinkError
from hardware.drivers.ev3_link import Ev3Link
from hardware.drivers.transport import HidTransport, SerialTransport, TcpTransport, open_hid
from hardware.emulators.ev3_brick import Ev3Brick
from hardware.protocols.ev3_codes import Instruction


class Wire:
    """USB as hidapi shows it, over an emulated brick at byte level; it can be cut."""

    def __init__(self, brick=None, broken=None, taken=True):
        self.brick = brick
        self.broken = broken
        self.taken = taken
        self.answer = b""
        self.opened = None
        self.closed = False

    def open(self, vendor, product, serial=None):
        if self.broken:
            raise self.broken
        self.opened = vendor, product, serial

    def write(self, buff):
        if self.broken:
            raise self.broken
        if not self.taken:
            return -1
        self.answer = self.brick.exchange(bytes(buff[1 : 3 + int.from_bytes(buff[1:3], "little")]))
        return len(buff)

    def read(self, max_length, timeout_ms=0):
        if self.broken:
            raise self.broken
        report, self.answer = self.answer, b""
        return list(report.ljust(max_length, b"\x55")) if report else []

    def close(self):
        self.closed = True


@pytest.fixture
def hid(monkeypatch):
    """The module of hidapi, with one device."""

    def install(wire):
        monkeypatch.setitem(sys.modules, "hid", SimpleNamespace(device=lambda: wire))
        return wire

    return install


def test_a_brick_on_usb_is_found_by_its_number_and_answers(hid, rollers):
    wire = hid(Wire(Ev3Brick(rollers, wifi=False)))
    link = ev3_link.connect("usb:001653422b99")
    assert wire.opened == (0x0694, 0x0005, "001653422b99")
    assert link.ask(Instruction("NOP", ())).values == b""
    link.close()
    assert wire.closed


def test_a_brick_that_may_not_be_opened_is_an_error_with_the_udev_rule(hid):
    hid(Wire(broken=OSError("open failed")))
    with pytest.raises(LinkError, match=r"99-bricktwin\.rules"):
        open_hid()


def test_usb_without_its_package_is_an_error_with_the_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "hid", None)
    with pytest.raises(DeviceError, match="pip install"):
        open_hid()


def test_a_cable_that_is_pulled_out_is_a_broken_link():
    wire = HidTransport(Wire(broken=OSError("gone")))
    for use in (lambda: wire.read(0.01), lambda: wire.write(b"\1\0")):
        with pytest.raises(LinkError, match="it is gone"):
            use()
    with pytest.raises(LinkError, match="does not take a message"):
        HidTransport(Wire(taken=False)).write(b"\1\0")


def test_a_brick_that_refuses_is_an_error_that_names_the_command(rollers):
    link = Ev3Link(HidTransport(Wire(Ev3Brick(rollers, wifi=False))))
    with pytest.raises(DeviceError, match="it refuses OUTPUT_STEP_SYNC"):
        link.ask(Instruction("OUTPUT_STEP_SYNC", (0, 1, 20, 0, 100, 1)))


def test_a_brick_that_is_silent_is_a_broken_link():
    class Mute:
        def exchange(self, received):
            return b""

    with pytest.raises(LinkError, match="it does not answer"):
        Ev3Link(HidTransport(Wire(Mute()))).ask(Instruction("NOP", ()), timeout=0.05)


def test_what_is_no_reply_is_a_broken_link():
    class Other:
        def exchange(self, received):
            return b"\x03\x00\x01\x00\x77"

    with pytest.raises(LinkError, match="no reply"):
        Ev3Link(HidTransport(Wire(Other()))).ask(Instruction("NOP", ()), timeout=0.5)


def test_a_serial_port_that_may_not_be_used_is_an_error_with_the_udev_rule(monkeypatch):
    import serial

    def refuse(*_, **__):
        raise serial.SerialException(errno.EACCES, "permission denied")

    monkeypatch.setattr(serial, "Serial", refuse)
    with pytest.raises(DeviceError, match="permission denied; put the line SUBSYSTEM"):
        SerialTransport("/dev/ttyACM0", "lidar")


def test_a_connection_that_is_cut_is_a_broken_link():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        way = TcpTransport(*listener.getsockname())
        listener.accept()[0].close()
        with pytest.raises(LinkError, match="closed the connection"):
            way.read(1.0)
        way.close()
        for use in (lambda: way.read(0.0), lambda: way.write(b"x")):
            with pytest.raises(LinkError, match="the connection is broken"):
                use()


@pytest.mark.wall_clock
def test_a_wifi_without_a_brick_is_an_error():
    with pytest.raises(LinkError, match="no brick is heard"):
        ev3_link.find_by_beacon("no such brick", timeout=0.05)


@pytest.mark.wall_clock
def test_two_programs_cannot_listen_for_beacons():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rival:
        rival.bind(("", 3015))
        with pytest.raises(LinkError, match="UDP port 3015 is taken"):
            ev3_link.find_by_beacon(timeout=0.05)
