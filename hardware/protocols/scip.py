"""SCIP 2.0, the language of Hokuyo's lidars: requests and replies to bytes and back (specification C-42-03320B)."""

from __future__ import annotations

import re
from typing import NamedTuple

from hardware.protocols.errors import ProtocolError

LONGEST_LINE = 256
OK, DATA = "00", "99"
"""Statuses: a command has been accepted, a scan of a stream."""


class Request(NamedTuple):
    """A command to the lidar."""

    command: str
    """Two letters, or `SCIP2.0`, or `%ST`."""
    parameters: str = ""
    tag: str = ""
    """Up to 16 characters that the reply repeats."""

    def line(self) -> str:
        """What the reply repeats."""
        return self.command + self.parameters + (f";{self.tag}" if self.tag else "")

    def pack(self) -> bytes:
        """As it goes over the wire."""
        return self.line().encode("ascii") + b"\n"


class Reply(NamedTuple):
    """An answer, its sums checked."""

    echo: str
    status: str
    lines: tuple[str, ...] = ()
    """Without their sums."""

    def pack(self) -> bytes:
        """As it goes over the wire."""
        skipped = _summed(self.echo)
        lines = [self.echo, self.status + checksum(self.status), *(line + checksum(line[:skipped]) for line in self.lines)]
        return "".join(line + "\n" for line in (*lines, "")).encode("latin-1")


class Geometry(NamedTuple):
    """What the lidar says of itself in PP."""

    model: str
    shortest_mm: int
    longest_mm: int
    steps: int
    """Steps of a whole turn."""
    first: int
    last: int
    front: int
    """Step that looks along x."""
    rpm: int

    def lines(self) -> tuple[str, ...]:
        """As PP says it."""
        numbers = zip(_NUMBERS, self[1:], strict=True)
        return (f"MODL:{self.model};", *(f"{key}:{number};" for key, number in numbers))


class Stream(NamedTuple):
    """Parameters of MD and MS."""

    first: int
    last: int
    cluster: int = 1
    skipped: int = 0
    scans: int = 0
    """Scans to deliver; 0: until QT."""

    def pack(self) -> str:
        """As they stand behind the command."""
        return f"{self.first:04d}{self.last:04d}{self.cluster:02d}{self.skipped:01d}{self.scans:02d}"


_OF_FIELDS = ("VV", "PP", "II")
"""Commands that are answered by `KEY:value;` lines."""
_NUMBERS = ("DMIN", "DMAX", "ARES", "AMIN", "AMAX", "AFRT", "SCAN")
_REQUEST = re.compile(r"(SCIP2\.0|%ST|[A-Z]{2})([^;]*)(?:;(.{0,16}))?")


def checksum(text: str) -> str:
    """The sum of a text, one character."""
    return chr((sum(text.encode("latin-1")) & 0x3F) + 0x30)


def parse_request(line: str) -> Request:
    """A line from the host, as the lidar sees it.

    Raises:
        ProtocolError: it is no command.
    """
    found = _REQUEST.fullmatch(line)
    if found is None:
        raise ProtocolError("SCIP", "not a command", line.encode("latin-1", "replace"))
    return Request(found[1], found[2], found[3] or "")


def parse_reply(lines: list[str]) -> Reply:
    """The lines of one reply without the empty one at its end.

    Raises:
        ProtocolError: a line is missing or its sum is wrong.
    """
    if len(lines) < 2:
        raise ProtocolError("SCIP", "a reply has an echo and a status", "\n".join(lines).encode("latin-1", "replace"))
    status, skipped = _checked(lines[1]), _summed(lines[0])
    if len(status) != 2:
        raise ProtocolError("SCIP", "a status has two characters", lines[1].encode("latin-1", "replace"))
    return Reply(lines[0], status, tuple(_checked(line, skipped) for line in lines[2:]))


class Replies:
    """Cuts a stream of bytes into replies; what cannot be one is dropped and counted, and the next one is found again."""

    def __init__(self) -> None:
        self._buffer = b""
        self._lines: list[str] = []
        self.broken = 0
        """Replies that were dropped."""

    def feed(self, received: bytes) -> list[Reply]:
        """Replies that are complete now."""
        *lines, self._buffer = (self._buffer + received).split(b"\n")
        if len(self._buffer) > LONGEST_LINE:
            self._buffer = self._buffer[-LONGEST_LINE:]
        return [reply for line in lines if (reply := self._take(line)) is not None]

    def _take(self, line: bytes) -> Reply | None:
        if line:
            self._lines.append(line.decode("latin-1"))
            return None
        lines, self._lines = self._lines, []
        try:
            return parse_reply(lines) if lines else None
        except ProtocolError:
            self.broken += 1
            return None


def parse_geometry(reply: Reply) -> Geometry:
    """What the answer to PP says.

    Raises:
        ProtocolError: a line is missing or is no number.
    """
    fields = parse_fields(reply)
    try:
        return Geometry(fields["MODL"], *(int(fields[key]) for key in _NUMBERS))
    except (KeyError, ValueError) as error:
        raise ProtocolError("SCIP", f"PP must tell MODL {' '.join(_NUMBERS)}: {error}") from error


def parse_fields(reply: Reply) -> dict[str, str]:
    """The `KEY:value` lines of VV, PP and II."""
    pairs = (line.rstrip(";").partition(":") for line in reply.lines)
    return {key: value for key, _, value in pairs}


def parse_stream(parameters: str) -> Stream:
    """Parameters of MD and MS, as the lidar sees them.

    Raises:
        ProtocolError: they are not thirteen digits.
    """
    if re.fullmatch(r"[0-9]{13}", parameters) is None:
        raise ProtocolError("SCIP", "MD takes thirteen digits", parameters.encode("latin-1", "replace"))
    return Stream(*(int(parameters[a:b]) for a, b in ((0, 4), (4, 8), (8, 10), (10, 11), (11, 13))))


def _summed(echo: str) -> int | None:
    """Where the sum of a line ends: before the `;` of a `KEY:value;` line, which is not summed."""
    return -1 if echo[:2] in _OF_FIELDS else None


def _checked(line: str, end: int | None = None) -> str:
    """A line without its sum."""
    text, total = line[:-1], line[-1:]
    if not text or checksum(text[:end]) != total:
        raise ProtocolError("SCIP", "a wrong sum", line.encode("latin-1", "replace"))
    return text
