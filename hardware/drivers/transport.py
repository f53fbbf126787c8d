"""Ways for bytes to a device: TCP, serial ports and everything that looks like one, USB HID."""

from __future__ import annotations

import errno
import select
import socket
import time
from typing import Protocol

from hardware.drivers.errors import DeviceError, LinkError, permission

CHUNK = 1 << 16
CONNECT_TIME = 2.0
"""[s]"""
SERIAL_TICK = 0.005
"""Longest time that the serial port sleeps at once [s]."""
EV3_USB = (0x0694, 0x0005)
"""Vendor and product."""
REPORT = 1024
"""Length of a HID report of the EV3 [bytes]."""


class Transport(Protocol):
    """A way for bytes, in both directions."""

    def read(self, timeout: float) -> bytes:
        """What has come; nothing after `timeout` [s].

        Raises:
            LinkError: the way is broken.
        """
        ...

    def write(self, message: bytes) -> None:
        """Send.

        Raises:
            LinkError: the way is broken.
        """
        ...

    def close(self) -> None:
        """Let go. May be called twice."""
        ...


class TcpTransport:
    """A TCP connection."""

    def __init__(self, host: str, port: int) -> None:
        """Connect.

        Raises:
            LinkError: nobody answers there.
        """
        self._name = f"tcp:{host}:{port}"
        try:
            self._socket = socket.create_connection((host, port), CONNECT_TIME)
        except (OSError, OverflowError, UnicodeError) as error:
            raise LinkError(
                self._name, f"cannot connect ({error})", "check the address, and that the device or its emulator is on"
            ) from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self, timeout: float) -> bytes:
        """See `Transport`."""
        try:
            if not select.select([self._socket], [], [], max(timeout, 0.0))[0]:
                return b""
            received = self._socket.recv(CHUNK)
        except (OSError, ValueError) as error:
            raise LinkError(self._name, f"the connection is broken ({error})", "check the network") from error
        if not received:
            raise LinkError(self._name, "the device has closed the connection", "check that it is on and has no other client")
        return received

    def write(self, message: bytes) -> None:
        """See `Transport`."""
        try:
            self._socket.sendall(message)
        except OSError as error:
            raise LinkError(self._name, f"the connection is broken ({error})", "check the network") from error

    def close(self) -> None:
        """See `Transport`."""
        self._socket.close()


class SerialTransport:
    """A serial port, a USB device that looks like one, a Bluetooth channel or a pseudo-terminal."""

    def __init__(self, path: str, kind: str) -> None:
        """Open it.

        Args:
            path: of the port, /dev/ttyACM0 or COM3.
            kind: key of `errors.RULE`.

        Raises:
            LinkError: it is not there, or this user may not use it.
        """
        import serial

        self._path = path
        self._broken = serial.SerialException
        try:
            self._port = serial.Serial(path, 115200, timeout=0.0, write_timeout=1.0, exclusive=True)
        except (OSError, ValueError) as error:
            if getattr(error, "errno", None) == errno.EACCES:
                raise permission(path, kind) from error
            raise LinkError(
                path, f"cannot be opened ({error})", "plug the device in, or name another port; `twin doctor` lists them"
            ) from error

    def read(self, timeout: float) -> bytes:
        """See `Transport`."""
        end = time.monotonic() + timeout
        while True:
            try:
                received = self._port.read(CHUNK)
            except (OSError, TypeError) as error:  # pyserial meets its own closed file as a TypeError
                raise LinkError(self._path, f"the port is gone ({error})", "plug the device in again") from error
            left = end - time.monotonic()
            if received or left <= 0.0:
                return received
            time.sleep(min(left, SERIAL_TICK / 4))

    def write(self, message: bytes) -> None:
        """See `Transport`."""
        try:
            self._port.write(message)
        except OSError as error:
            raise LinkError(self._path, f"the port is gone ({error})", "plug the device in again") from error

    def close(self) -> None:
        """See `Transport`."""
        self._port.close()


class HidDevice(Protocol):
    """What hidapi gives."""

    def write(self, buff: bytes) -> int:
        """Send a report that begins with its number; -1: it failed."""
        ...

    def read(self, max_length: int, timeout_ms: int = 0) -> list[int]:
        """A report; empty after the timeout."""
        ...

    def close(self) -> None:
        """Let go."""
        ...


class HidTransport:
    """The EV3 on USB: every message is a report of 1024 bytes."""

    def __init__(self, device: HidDevice) -> None:
        self._device = device

    def read(self, timeout: float) -> bytes:
        """See `Transport`; a report, cut to the message in it."""
        try:
            report = bytes(self._device.read(REPORT, max(1, round(timeout * 1e3))))
        except (OSError, ValueError) as error:
            raise LinkError("EV3 on USB", f"it is gone ({error})", "plug it in again and switch it on") from error
        return report[: 2 + int.from_bytes(report[:2], "little")]

    def write(self, message: bytes) -> None:
        """See `Transport`."""
        try:
            sent = self._device.write(b"\0" + message.ljust(REPORT, b"\0"))
        except (OSError, ValueError) as error:
            raise LinkError("EV3 on USB", f"it is gone ({error})", "plug it in again and switch it on") from error
        if sent < 0:
            raise LinkError("EV3 on USB", "it does not take a message", "plug it in again and switch it on")

    def close(self) -> None:
        """See `Transport`."""
        self._device.close()


def open_hid(serial: str = "") -> HidTransport:
    """The EV3 on USB, by its serial number when there are several.

    Raises:
        DeviceError: hidapi is missing, or the brick is.
    """
    try:
        import hid
    except ImportError as error:
        raise DeviceError("EV3 on USB", "the package hidapi is missing", "pip install 'bricktwin[robot]'") from error
    device = hid.device()
    try:
        device.open(*EV3_USB, serial or None)
    except (OSError, ValueError) as error:
        raise LinkError("EV3 on USB", "no brick that may be opened", f"plug it in and switch it on; {permission('EV3', 'EV3')}") from error
    return HidTransport(device)


def host_and_port(address: str, port: int) -> tuple[str, int]:
    """The parts of HOST[:PORT].

    Raises:
        DeviceError: the port is no number.
    """
    host, _, number = address.partition(":")
    if number and not (number.isascii() and number.isdigit() and 0 < int(number) <= 0xFFFF):
        raise DeviceError(f"tcp:{address}", f"'{number}' is no port", "write tcp:HOST or tcp:HOST:PORT with a port within 1 and 65535")
    return host or "127.0.0.1", int(number) if number else port
