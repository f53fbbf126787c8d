"""The Hokuyo URG-04LX-UG01 as its client sees it: SCIP 2.0."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hardware.protocols import scip, scip_numbers, scip_sweep
from hardware.protocols.errors import ProtocolError
from hardware.protocols.scip import Geometry, Reply, Request, Stream
from hardware.protocols.scip_sweep import Sweep

UG01 = Geometry("URG-04LX-UG01(Simple-URG)(Hokuyo Automatic Co.,Ltd.)", 20, 5600, 1024, 44, 725, 384, 600)
VERSION = (
    "VEND:Hokuyo Automatic Co.,Ltd.;",
    "PROD:SOKUIKI Sensor URG-04LX-UG01(Simple-URG);",
    "FIRM:3.4.03(17/Dec./2012);",
    "PROT:SCIP 2.0;",
    "SERI:H0000000;",
)
UNKNOWN, LASER_OFF, ALREADY_ON, ALREADY = "0E", "10", "02", "03"
"""Statuses: undefined command; GD without laser; BM with laser; a setting that is in force."""
LONGEST_LINE = 256
SHORT_END_MM = 4095
"""Longest range in two characters."""


class Turn(NamedTuple):
    """One turn of the mirror."""

    stamp: float
    """The source's clock when the lidar passed its zero [s]."""
    ranges_mm: NDArray[np.int64]
    """(AMAX - AMIN + 1,); below 20 a code."""


@dataclass
class _Order:
    """A scan, or a stream of scans, that a client waits for."""

    command: str
    stream: Stream
    left: int
    """Scans that are still to come; 0: endless."""
    skip: int = 0
    """Scans to leave out before the next one."""


class UrgLidar:
    """A `Device` that reports the turns of a source. Laser and timer are as the client left them."""

    def __init__(
        self, source: Callable[[], Turn | None], clock: Callable[[], float], *, zero_ms: int = 12345678, spin_up: float = 0.0
    ) -> None:
        """Power on.

        Args:
            source: the last whole turn, or the next one in order; None: there is none.
            clock: the time of the turns' stamps [s].
            zero_ms: what the lidar's own clock says at time 0; it wraps.
            spin_up: time from now on until the motor is fast enough [s].
        """
        self._source = source
        self._clock = clock
        self._zero_ms = zero_ms
        self._turning = clock() + spin_up
        self._buffer = b""
        self._last = -np.inf
        self._order: _Order | None = None
        self.laser = False
        self.timing = False
        """In the mode that TM0 begins and TM2 ends."""
        self._answers: dict[str, Callable[[Request], Reply]] = {
            "VV": lambda request: _reply(request, lines=VERSION),
            "PP": lambda request: _reply(request, lines=UG01.lines()),
            "II": self._state,
            "BM": self._switch_on,
            "QT": self._switch_off,
            "RS": self._switch_off,
            "RT": self._switch_off,
            "TM": self._tell_time,
            "MD": self._start,
            "MS": self._start,
            "GD": self._start,
            "GS": self._start,
            "SS": lambda request: _reply(request, "03" if request.parameters == "019200" else "04"),
            "CR": lambda request: _reply(request, "03" if request.parameters in ("00", "99") else "04"),
        }

    def attach(self) -> None:
        """A client has come; it finds the lidar as the one before has left it."""
        self._buffer = b""

    def tick(self) -> None:
        """See `Device`: nothing, the mirror turns by itself."""

    def exchange(self, received: bytes) -> bytes:
        """See `Device`."""
        *lines, rest = (self._buffer + received).replace(b"\r", b"\n").split(b"\n")
        self._buffer = rest[-LONGEST_LINE:]
        answers = b"".join(self._answer(line.decode("latin-1")) for line in lines if line)  # a bare line feed gets no answer
        return answers or self._turned()  # a scan never shares a packet with an answer

    def _answer(self, line: str) -> bytes:
        try:
            request = scip.parse_request(line)
        except ProtocolError:
            return Reply(line, UNKNOWN).pack()
        answer = self._answers.get(request.command)
        if answer is None or (self.timing and request.command != "TM"):
            return _reply(request, UNKNOWN).pack()
        reply = answer(request)
        return b"" if self._order is not None and self._order.command[:2] in ("GD", "GS") and reply.status == scip.OK else reply.pack()

    def _turned(self) -> bytes:
        """What a new turn of the mirror lets it say."""
        turn, order = self._new_turn(), self._order
        if turn is None or order is None:
            return b""
        if order.skip > 0:
            order.skip -= 1
            return b""
        return self._scan(turn, order)

    def _new_turn(self) -> Turn | None:
        turn = self._source()
        if turn is None or turn.stamp <= self._last or self._clock() < self._turning:
            return None
        self._last = turn.stamp
        return turn

    def _scan(self, turn: Turn, order: _Order) -> bytes:
        stream, single = order.stream, order.command[0] == "G"
        order.skip = stream.skipped
        order.left -= 1 if order.left else 0
        echo = order.command if single else order.command[:2] + stream._replace(scans=order.left).pack() + order.command[15:]
        if single or (stream.scans and not order.left):
            self._order = None
            self.laser = self.laser and single
        sweep = Sweep(self._milliseconds(turn.stamp), _clustered(turn.ranges_mm, stream))
        size = 3 if order.command[1] == "D" else 2
        if size == 2:
            sweep = sweep._replace(ranges_mm=np.minimum(sweep.ranges_mm, SHORT_END_MM))
        return Reply(echo, scip.OK if single else scip.DATA, scip_sweep.sweep_lines(sweep, size)).pack()

    def _start(self, request: Request) -> Reply:
        single = request.command[0] == "G"
        status, stream = _check(request.parameters + ("000" if single else ""))
        if stream is None:
            return _reply(request, status)
        if single and not self.laser:
            return _reply(request, LASER_OFF)
        self.laser = True
        self._new_turn()  # the one that has just ended is not delivered
        self._order = _Order(request.line(), stream, stream.scans)
        return _reply(request)

    def _switch_on(self, request: Request) -> Reply:
        status, self.laser = ALREADY_ON if self.laser else scip.OK, True
        return _reply(request, status)

    def _switch_off(self, request: Request) -> Reply:
        self._order, self.laser = None, False
        if request.command == "RS":
            self._zero_ms = -round(self._clock() * 1e3)
        return _reply(request)

    def _tell_time(self, request: Request) -> Reply:
        match request.parameters, self.timing:
            case ("0", True):
                return _reply(request, "02")
            case ("0", False):
                self.timing, self.laser, self._order = True, False, None
                return _reply(request)
            case ("1", True):
                return _reply(request, lines=(scip_numbers.encode_number(self._milliseconds(self._clock()), 4),))
            case ("2", True):
                self.timing = False
                return _reply(request)
            case ("1" | "2", False):
                return _reply(request, "04" if request.parameters == "1" else ALREADY)
            case _:
                return _reply(request, "01")

    def _state(self, request: Request) -> Reply:
        now_ms, works = self._milliseconds(self._clock()), self._clock() >= self._turning
        return _reply(
            request,
            lines=(
                f"MODL:{UG01.model};",
                f"LASR:{'ON' if self.laser else 'OFF'};",
                "SCSP:Initial(600[rpm])<-Default setting by user;",
                "MESM:IDLE;",
                "SBPS:USB Full Speed;",
                f"TIME:{now_ms:06X};",
                f"STAT:{'Sensor works well.' if works else 'Motor is starting.'};",
            ),
        )

    def _milliseconds(self, t: float) -> int:
        return (self._zero_ms + int(t * 1e3)) % scip_sweep.WRAP_MS


def _reply(request: Request, status: str = scip.OK, lines: tuple[str, ...] = ()) -> Reply:
    return Reply(request.line(), status, lines)


def _check(parameters: str) -> tuple[str, Stream | None]:
    """Status, and the stream when it is possible."""
    if len(parameters) < 13:
        return "0C", None
    for status, part in (("01", parameters[:4]), ("02", parameters[4:8]), ("03", parameters[8:10]), ("06", parameters[10:11])):
        if not (part.isascii() and part.isdigit()):
            return status, None
    try:
        stream = scip.parse_stream(parameters)
    except ProtocolError:
        return "07", None
    if stream.last < stream.first:
        return "05", None
    return ("04", None) if stream.first < UG01.first or stream.last > UG01.last else (scip.OK, stream)


def _clustered(ranges_mm: NDArray[np.int64], stream: Stream) -> NDArray[np.int64]:
    """The asked part of a turn: of each group of steps the shortest range, or its code when it has none."""
    asked, size = ranges_mm[stream.first - UG01.first : stream.last - UG01.first + 1], max(stream.cluster, 1)
    if size == 1:
        return asked
    starts = np.arange(0, len(asked), size)
    valid = np.where(asked < scip_sweep.SHORTEST_MM, np.iinfo(np.int64).max, asked)
    shortest = np.minimum.reduceat(valid, starts)
    return np.where(shortest == np.iinfo(np.int64).max, asked[starts], shortest)
