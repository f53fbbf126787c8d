"""How the emulated camera sends its pictures: messages with a length and a sum. A real D435 speaks to the vendor's library only."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from hardware.protocols.errors import ProtocolError

PROTOCOL = "camera frames"
MAGIC = b"RGBD"
_HEAD = struct.Struct("<4sBII")
"""Magic, kind, length and CRC-32 of the rest."""
_PAIR = struct.Struct("<IqqHHHH")
LONGEST = 1 << 24
"""Longest rest of a message [bytes]: more than 1920 x 1080 colours with 1280 x 720 depths."""


class Kind(IntEnum):
    """What a message is."""

    HELLO = 1
    """The camera says what it is."""
    PAIR = 2
    """A colour and a depth image."""
    TIME = 3
    """The client asks for the camera's time with a number of its own; the camera repeats the number and adds its time."""


class Message(NamedTuple):
    """One message, its sum checked."""

    kind: int
    body: bytes


@dataclass(frozen=True, slots=True)
class Lens:
    """One imager, as the factory has measured it."""

    width: int
    height: int
    focal: tuple[float, float]
    centre: tuple[float, float]
    distortion: tuple[float, float, float, float, float]
    """Brown-Conrady k1 k2 p1 p2 k3."""


@dataclass(frozen=True, slots=True)
class Hello:
    """What a camera is."""

    serial: str
    colour: Lens
    depth: Lens
    rotation: tuple[float, ...]
    """Of the depth camera in the frame of the colour camera, (9,) row by row."""
    translation: tuple[float, float, float]
    """Its place there [m]."""
    depth_unit: float
    """Of one step of a depth [m]."""
    rate: int
    """Images in a second."""


class Pair(NamedTuple):
    """A colour image and a depth image of one moment."""

    number: int
    middle_us: int
    """Middle of the exposure on the camera's clock."""
    sent_us: int
    """When its transfer began, on the same clock."""
    colour: NDArray[np.uint8]
    """(H, W, 3) red, green, blue."""
    depth: NDArray[np.uint16]
    """(H, W) in steps of the depth unit; 0: not measured."""


def pack(kind: Kind, body: bytes) -> bytes:
    """A message as it goes over the wire."""
    return _HEAD.pack(MAGIC, kind, len(body), zlib.crc32(body)) + body


def pack_hello(hello: Hello) -> bytes:
    """What a camera says first."""
    return pack(Kind.HELLO, msgspec.json.encode(hello))


def parse_hello(body: bytes) -> Hello:
    """The reverse of `pack_hello`.

    Raises:
        ProtocolError: it is none.
    """
    try:
        hello = msgspec.json.decode(body, type=Hello)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ProtocolError(PROTOCOL, f"a camera that does not say what it is ({error})", body) from error
    if len(hello.rotation) != 9 or min(hello.colour.width, hello.colour.height, hello.depth.width, hello.depth.height, hello.rate) < 1:
        raise ProtocolError(PROTOCOL, "a camera without pixels, without a rate or with half a rotation", body)
    return hello


def pack_pair(pair: Pair) -> bytes:
    """Two images."""
    sizes = pair.colour.shape[1], pair.colour.shape[0], pair.depth.shape[1], pair.depth.shape[0]
    head = _PAIR.pack(pair.number, pair.middle_us, pair.sent_us, *sizes)
    return pack(Kind.PAIR, head + pair.colour.tobytes() + pair.depth.astype("<u2").tobytes())


def parse_pair(body: bytes) -> Pair:
    """The reverse of `pack_pair`.

    Raises:
        ProtocolError: it is none.
    """
    if len(body) < _PAIR.size:
        raise ProtocolError(PROTOCOL, f"a pair of images needs {_PAIR.size} bytes, it has {len(body)}", body)
    number, middle_us, sent_us, width, height, depth_width, depth_height = _PAIR.unpack_from(body)
    colours, depths = 3 * width * height, depth_width * depth_height
    if len(body) != _PAIR.size + colours + 2 * depths:
        raise ProtocolError(PROTOCOL, f"images of {width} x {height} and {depth_width} x {depth_height} do not fit {len(body)} bytes", body)
    colour = np.frombuffer(body, np.uint8, colours, _PAIR.size).reshape(height, width, 3)
    depth = np.frombuffer(body, "<u2", depths, _PAIR.size + colours).reshape(depth_height, depth_width)
    return Pair(number, middle_us, sent_us, colour, depth.astype(np.uint16))


def pack_time(number: int, time_us: int = 0) -> bytes:
    """A question for the camera's time, or its answer."""
    return pack(Kind.TIME, struct.pack("<Iq", number, time_us))


def parse_time(body: bytes) -> tuple[int, int]:
    """Number and time [us].

    Raises:
        ProtocolError: it is none.
    """
    if len(body) != 12:
        raise ProtocolError(PROTOCOL, f"a time has 12 bytes, not {len(body)}", body)
    number, time_us = struct.unpack("<Iq", body)
    return number, time_us


class Messages:
    """Cuts a stream into messages."""

    def __init__(self) -> None:
        self._pending = bytearray()

    def feed(self, received: bytes) -> list[Message]:
        """Messages that are complete now.

        Raises:
            ProtocolError: what comes is no message; the stream cannot be gone on with.
        """
        self._pending += received
        found: list[Message] = []
        while len(self._pending) >= _HEAD.size:
            magic, kind, length, crc = _HEAD.unpack_from(self._pending)
            if magic != MAGIC or length > LONGEST:
                raise ProtocolError(PROTOCOL, "no message begins here", bytes(self._pending[:24]))
            end = _HEAD.size + length
            if len(self._pending) < end:
                break
            body = bytes(memoryview(self._pending)[_HEAD.size : end])
            if zlib.crc32(body) != crc:
                raise ProtocolError(PROTOCOL, "a message with a wrong sum", bytes(self._pending[:24]))
            del self._pending[:end]
            found.append(Message(kind, body))
        return found
