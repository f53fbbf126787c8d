"""Talking to an EV3: one question at a time, over whatever way there is."""

from __future__ import annotations

import socket
import time
from typing import NamedTuple

from hardware.drivers.errors import DeviceError, LinkError
from hardware.drivers.transport import SerialTransport, TcpTransport, Transport, host_and_port, open_hid
from hardware.protocols import ev3_direct
from hardware.protocols.errors import ProtocolError
from hardware.protocols.ev3_codes import Instruction
from hardware.protocols.ev3_direct import Beacon, Messages

ANSWER_TIME = 1.0
"""Longest wait for an answer [s]."""
BEACON_TIME = 6.0
"""The brick says where it is every 5 s [s]."""
FORMS = "write usb, usb:SERIAL, tcp:HOST, tcp:HOST:PORT, wifi, wifi:SERIAL, or the path of a serial port"


class Answer(NamedTuple):
    """What the brick answered."""

    stamp: float
    """Midpoint of question and answer on the host's clock [s]."""
    values: bytes


class Ev3Link:
    """Questions and answers. Only one thread may use it."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._messages = Messages()
        self._counter = 0

    def ask(self, *instructions: Instruction, global_bytes: int = 0, timeout: float = ANSWER_TIME) -> Answer:
        """Make the brick carry out instructions, and wait for its answer.

        Raises:
            LinkError: there is none in `timeout` [s], or the way is broken.
            DeviceError: the brick refuses.
        """
        self._counter = (self._counter + 1) & 0xFFFF
        message = ev3_direct.command(self._counter, *instructions, global_bytes=global_bytes)
        sent = time.monotonic()
        self._transport.write(message)
        reply = self._awaited(sent + timeout)
        if not reply.ok or len(reply.values) != global_bytes:
            raise DeviceError(
                "EV3", f"it refuses {instructions[0].name} and what follows", "check what is plugged into its ports; restart it"
            )
        return Answer(0.5 * (sent + time.monotonic()), reply.values)

    def close(self) -> None:
        """Let go. May be called twice."""
        self._transport.close()

    def _awaited(self, end: float) -> ev3_direct.Reply:
        while (left := end - time.monotonic()) > 0.0:
            try:
                replies = [ev3_direct.parse_reply(message) for message in self._messages.feed(self._transport.read(left))]
            except ProtocolError as error:
                raise LinkError(
                    "EV3", f"it says what is no reply ({error})", "check the cable, and that nobody else talks to it"
                ) from error
            for reply in replies:
                if reply.counter == self._counter:  # an older one belongs to a question that was given up
                    return reply
        raise LinkError("EV3", "it does not answer", "check that it is on and that no program on it holds the ports")


def connect(address: str) -> Ev3Link:
    """Find the brick.

    Args:
        address: `usb[:SERIAL]`, `tcp:HOST[:PORT]`, `wifi[:SERIAL]` or the path of a serial port.

    Raises:
        DeviceError: it is not there or may not be used.
    """
    way, _, rest = address.partition(":")
    if way == "usb":
        return Ev3Link(open_hid(rest))
    if way == "tcp":
        return _unlocked(*host_and_port(rest, ev3_direct.TCP_PORT))
    if way == "wifi":
        host, beacon = find_by_beacon(rest)
        return _unlocked(host, beacon.port, beacon.serial)
    if not address:
        raise DeviceError("EV3", "no address", FORMS)
    return Ev3Link(SerialTransport(address, "EV3"))


def find_by_beacon(serial: str = "", timeout: float = BEACON_TIME) -> tuple[str, Beacon]:
    """Host and beacon of a brick in the same WiFi, by its serial number when there are several.

    Raises:
        LinkError: none is heard in `timeout` [s].
    """
    end = time.monotonic() + timeout
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind(("", ev3_direct.BEACON_PORT))
        except OSError as error:
            raise LinkError(
                "EV3", f"UDP port {ev3_direct.BEACON_PORT} is taken", "close the other program that looks for bricks"
            ) from error
        while (left := end - time.monotonic()) > 0.0:
            listener.settimeout(left)
            try:
                datagram, (host, port) = listener.recvfrom(1024)
                beacon = ev3_direct.parse_beacon(datagram)
            except (TimeoutError, ProtocolError):
                continue
            if serial.lower() in ("", beacon.serial.lower()):
                listener.sendto(b" ", (host, port))
                return host, beacon
    raise LinkError("EV3", "no brick is heard in this WiFi", "switch WiFi on in the brick's menu, or write tcp:HOST")


def _unlocked(host: str, port: int, serial: str = "") -> Ev3Link:
    transport = TcpTransport(host, port)
    answer = b""
    try:
        transport.write(ev3_direct.unlock(serial))
        end = time.monotonic() + ANSWER_TIME
        while len(answer) < len(ev3_direct.UNLOCKED) and (left := end - time.monotonic()) > 0.0:
            answer += transport.read(left)
    except LinkError:
        transport.close()
        raise
    if answer != ev3_direct.UNLOCKED:
        transport.close()
        raise LinkError(
            f"tcp:{host}:{port}", f"this is no EV3, or it has another client (it says {answer[:24]!r})", "close the other client"
        )
    return Ev3Link(transport)
