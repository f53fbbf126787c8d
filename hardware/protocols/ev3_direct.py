"""EV3 direct commands: messages to bytes and back (lms2012, c_com.h and c_com.c)."""

from __future__ import annotations

import struct
from typing import NamedTuple

from hardware.protocols.errors import ProtocolError
from hardware.protocols.ev3_codes import Instruction, encode

LONGEST = 1024
"""Of a message with its length [bytes]."""
GLOBALS, LOCALS = 1021, 63
"""Most bytes of the reply and of a command's own memory."""
UNLOCKED = b"Accept:EV340\r\n\r\n"
"""What the brick answers to `unlock` over WiFi."""
BEACON_PORT, TCP_PORT = 3015, 5555
PERCENT_DEG = 132e6 / 4 / 256 / 12800
"""Rate of a large motor at 1 % of SPEED [deg/s]: d_pwm.c, 12800 timer ticks from degree to degree."""
NO_TYPE, NO_SENSOR, LARGE_MOTOR, MEDIUM_MOTOR, TOUCH, COLOUR, ULTRASONIC, GYRO, INFRARED = 125, 126, 7, 8, 16, 29, 30, 32, 33
"""Type codes of what is plugged in."""
GYRO_ANGLE, GYRO_RATE = 0, 1
"""Modes of the gyro."""
MOTOR_INPUTS = 16
"""Number of output A among the inputs."""
NO_FLOAT, NO_INT32, NO_INT16, NO_INT8 = float("nan"), -0x80000000, -0x8000, -0x80
"""What stands for "no data"."""

DIRECT_REPLY, DIRECT_NO_REPLY, SYSTEM_REPLY, SYSTEM_NO_REPLY = 0x00, 0x80, 0x01, 0x81
OK, SYSTEM_OK, ERROR, SYSTEM_ERROR = 0x02, 0x03, 0x04, 0x05


class Request(NamedTuple):
    """A message to the brick."""

    counter: int
    """0..65535; the reply carries it too."""
    codes: bytes
    wants_reply: bool = True
    global_bytes: int = 0
    """Size of the reply's values."""
    local_bytes: int = 0

    def pack(self) -> bytes:
        """As it goes over the wire.

        Raises:
            ProtocolError: a number is out of its range or the message is too long.
        """
        if not (0 <= self.counter <= 0xFFFF and 0 <= self.global_bytes <= GLOBALS and 0 <= self.local_bytes <= LOCALS):
            raise ProtocolError(
                "EV3", f"counter, globals and locals must be within 65535, {GLOBALS} and {LOCALS}, got {self[:1] + self[2:]}"
            )
        kind = DIRECT_REPLY if self.wants_reply else DIRECT_NO_REPLY
        return _framed(struct.pack("<HBH", self.counter, kind, self.global_bytes | self.local_bytes << 10) + self.codes)


class Reply(NamedTuple):
    """A message from the brick."""

    counter: int
    values: bytes = b""
    ok: bool = True

    def pack(self) -> bytes:
        """As it goes over the wire."""
        return _framed(struct.pack("<HB", self.counter, OK if self.ok else ERROR) + self.values)


def command(counter: int, *instructions: Instruction, reply: bool = True, global_bytes: int = 0) -> bytes:
    """A message that makes the brick carry out instructions.

    Raises:
        ProtocolError: they cannot be said.
    """
    return Request(counter, encode(*instructions), reply, global_bytes).pack()


def parse_request(message: bytes) -> Request:
    """A direct command, as the brick sees it.

    Raises:
        ProtocolError: it is none.
    """
    body = _body(message)
    if len(body) < 6 or body[2] not in (DIRECT_REPLY, DIRECT_NO_REPLY):
        raise ProtocolError("EV3", "not a direct command", message)
    counter, kind, sizes = struct.unpack_from("<HBH", body)
    return Request(counter, body[5:], kind == DIRECT_REPLY, sizes & 0x3FF, sizes >> 10)


def parse_reply(message: bytes) -> Reply:
    """A direct reply; what a report of USB has beyond its length is left away.

    Raises:
        ProtocolError: it is none.
    """
    body = _body(message)
    if len(body) < 3 or body[2] not in (OK, ERROR):
        raise ProtocolError("EV3", "not a direct reply", message)
    return Reply(int.from_bytes(body[:2], "little"), body[3:], body[2] == OK)


class Messages:
    """Cuts a stream of bytes into messages by their lengths."""

    def __init__(self) -> None:
        self._buffer = b""

    def feed(self, received: bytes) -> list[bytes]:
        """Messages, with their lengths, that are complete now.

        Raises:
            ProtocolError: a length that no message has: the stream is lost, close it.
        """
        self._buffer += received
        messages: list[bytes] = []
        while len(self._buffer) >= 2:
            end = 2 + int.from_bytes(self._buffer[:2], "little")
            if not 5 <= end <= LONGEST:
                lost, self._buffer = self._buffer, b""
                raise ProtocolError("EV3", f"a message has 5 to {LONGEST} bytes, this one says {end}", lost)
            if len(self._buffer) < end:
                break
            messages.append(self._buffer[:end])
            self._buffer = self._buffer[end:]
        return messages


def unlock(serial: str = "") -> bytes:
    """The text that opens a WiFi connection; the firmware looks for its first words only."""
    return f"GET /target?sn={serial}VMTP1.0\nProtocol: EV3".encode("ascii", "replace")


def is_unlock(text: bytes) -> bool:
    """Whether a client has asked for a WiFi connection."""
    return b"ET /target?sn=" in text[:100]


class Beacon(NamedTuple):
    """What the brick says of itself to everybody by UDP, every five seconds."""

    serial: str
    port: int = TCP_PORT
    name: str = "EV3"

    def pack(self) -> bytes:
        """As it goes over the wire."""
        return f"Serial-Number: {self.serial}\r\nPort: {self.port}\r\nName: {self.name}\r\nProtocol: EV3\r\n".encode("ascii", "replace")


def parse_beacon(datagram: bytes) -> Beacon:
    """A brick that is there.

    Raises:
        ProtocolError: it is no beacon of a brick.
    """
    lines = (line.partition(":") for line in datagram.decode("latin-1").splitlines())
    fields = {key.strip(): value.strip() for key, _, value in lines}
    port = fields.get("Port", "")
    if fields.get("Protocol") != "EV3" or not (port.isascii() and port.isdigit() and int(port) <= 0xFFFF):
        raise ProtocolError("EV3", "not the beacon of a brick", datagram)
    return Beacon(fields.get("Serial-Number", ""), int(port), fields.get("Name", ""))


def _framed(body: bytes) -> bytes:
    if len(body) + 2 > LONGEST:
        raise ProtocolError("EV3", f"a message has {LONGEST} bytes at most, this one {len(body) + 2}")
    return len(body).to_bytes(2, "little") + body


def _body(message: bytes) -> bytes:
    """A message without its length."""
    length = int.from_bytes(message[:2], "little")
    if len(message) < 5 or not 3 <= length <= len(message) - 2:
        raise ProtocolError("EV3", "a message that is cut", message)
    return message[2 : 2 + length]
