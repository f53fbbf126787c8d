"""Hokuyo lidars that speak SCIP 2.0, over USB and TCP."""

from __future__ import annotations

import time
from collections.abc import Callable

from hardware.drivers.device_thread import DeviceDriver, DeviceThread
from hardware.drivers.errors import DeviceError, LinkError
from hardware.drivers.lidar_clock import LidarClock, best_offset
from hardware.drivers.transport import SerialTransport, TcpTransport, Transport, host_and_port
from hardware.errors import HardwareError
from hardware.protocols import scip, scip_numbers, scip_sweep
from hardware.protocols.errors import ProtocolError
from hardware.protocols.scip import Geometry, Replies, Reply, Request, Stream
from hardware.queues import EventQueue
from hardware.spec import LidarSpec
from slam.messages import LaserScan

TCP_PORT = 10940
ANSWER_TIME = 0.5
"""Longest wait for an answer [s]."""
QUIET_TIME = 0.14
"""A lidar that says nothing for so long has stopped streaming [s]."""
QUIET_AT_MOST = 1.0
"""[s]"""
SILENCE = 0.5
"""Five scans that do not come: the lidar is lost [s]."""
EXCHANGES = 16
"""Of times, to measure the offset of the clocks."""
ROUNDING = 1e-3
"""Of the angles in a specification, in beams."""


class HokuyoDriver(DeviceDriver):
    """Fills the queue of scans from `open` to `close`."""

    def __init__(self, address: str, spec: LidarSpec, scans: EventQueue[LaserScan]) -> None:
        """Know where it is: the path of its serial port, or `tcp:HOST[:PORT]`."""
        super().__init__(DeviceThread(f"lidar at {address}", self._connect))
        self._address = address
        self._spec = spec
        self._scans = scans

    def open(self) -> None:
        """Connect, ask for the geometry, measure the clock, start the stream.

        Raises:
            DeviceError: the lidar is not there or is not what the specification says; nothing is held.
        """
        self._thread.open()

    def close(self) -> None:
        """Switch the laser off and let go. May be called twice."""
        self._thread.close()

    def _connect(self) -> HokuyoSession:
        transport = _transport(self._address)
        try:
            return HokuyoSession(transport, self._spec, self._scans.put)
        except HardwareError:
            transport.close()
            raise


class HokuyoSession:
    """A connected lidar. See `device_thread.Session`."""

    def __init__(self, transport: Transport, spec: LidarSpec, deliver: Callable[[LaserScan], None]) -> None:
        self._transport = transport
        self._spec = spec
        self._deliver = deliver
        self._replies = Replies()
        self._silence_quiet()
        self.geometry = self._ask_geometry()
        self._check(self.geometry)
        self._clock = LidarClock(*best_offset(self._exchange_times()))
        self._beams = self.geometry.last - self.geometry.first + 1
        self._increment = 60.0 / self.geometry.rpm / self.geometry.steps
        self._ask(Request("MD", Stream(self.geometry.first, self.geometry.last).pack()))
        self._heard = time.monotonic()

    def step(self) -> None:
        """See `Session`: pass on the scans that have come."""
        for reply in self._replies.feed(self._transport.read(0.1)):
            if reply.status == scip.DATA and reply.echo.startswith("MD"):
                self._pass_on(reply)
            elif reply.status not in (scip.OK, scip.DATA):
                raise LinkError("lidar", f"it has stopped with status {reply.status}", "keep its window free and plug it in again")
        if time.monotonic() - self._heard > SILENCE:
            raise LinkError("lidar", f"no scan for {SILENCE} s", "check the cable and its power: it draws up to 800 mA at the start")

    def close(self) -> None:
        """See `Session`."""
        try:
            self._transport.write(Request("QT").pack())
        except HardwareError:
            pass
        finally:
            self._transport.close()

    def _pass_on(self, reply: Reply) -> None:
        arrival = time.monotonic()
        try:
            sweep = scip_sweep.parse_sweep(reply, 3, self._beams)
        except ProtocolError:
            self._replies.broken += 1
            return
        self._heard = arrival
        step_zero = self._clock.host_time(sweep.stamp_ms)
        self._clock.observe(step_zero, arrival)
        spec, stamp = self._spec, step_zero + self.geometry.first * self._increment
        ranges = scip_sweep.to_metres(sweep.ranges_mm, self.geometry.longest_mm)
        self._deliver(LaserScan(stamp, ranges, spec.angles, self._increment, spec.range_min, spec.range_max, spec.T_base_laser))

    def _silence_quiet(self) -> None:
        """Stop whatever the client before had started."""
        self._transport.write(b"\n" + Request("TM", "2").pack() + Request("QT").pack())
        end = time.monotonic() + QUIET_AT_MOST
        while self._transport.read(QUIET_TIME):
            if time.monotonic() > end:
                raise LinkError("lidar", "it does not stop sending", "plug it out and in again")

    def _ask(self, request: Request) -> Reply:
        """The answer to a command.

        Raises:
            LinkError: there is none, or it says no.
        """
        self._transport.write(request.pack())
        end = time.monotonic() + ANSWER_TIME
        while (left := end - time.monotonic()) > 0.0:
            for reply in self._replies.feed(self._transport.read(left)):
                if reply.echo == request.line() and reply.status != scip.DATA:
                    return self._accepted(reply)
        raise LinkError("lidar", f"no answer to {request.line()}", "check that this is the lidar's port and plug it in again")

    def _accepted(self, reply: Reply) -> Reply:
        if reply.status != scip.OK:
            raise LinkError("lidar", f"it answers {reply.echo} with status {reply.status}", "plug it in again; keep its window free")
        return reply

    def _ask_geometry(self) -> Geometry:
        try:
            return scip.parse_geometry(self._ask(Request("PP")))
        except ProtocolError as error:
            raise LinkError("lidar", str(error), "check that this is a Hokuyo with SCIP 2.0") from error

    def _check(self, geometry: Geometry) -> None:
        """That the specification is of this lidar."""
        spec, increment = self._spec, 2.0 * 3.141592653589793 / geometry.steps
        first = (geometry.first - geometry.front) * increment
        same = geometry.last - geometry.first + 1 == spec.beams and abs(first - spec.angle_min) < ROUNDING * increment
        if not same or abs(increment - spec.angle_increment) * spec.beams > ROUNDING:
            what = f"it is a {geometry.model.split('(')[0]} with {geometry.last - geometry.first + 1} beams from {first:.4f} rad on"
            raise DeviceError(
                "lidar", f"{what}, the specification says {spec.beams} from {spec.angle_min:.4f}", "correct [lidar] in robot.toml"
            )

    def _exchange_times(self) -> list[tuple[float, int, float]]:
        """Times of question and answer on the host's clock [s], and the counter between them."""
        samples: list[tuple[float, int, float]] = []
        self._ask(Request("TM", "0"))
        for _ in range(EXCHANGES):
            sent = time.monotonic()
            reply = self._ask(Request("TM", "1"))
            if reply.lines:
                samples.append((sent, scip_numbers.decode_number(reply.lines[0]), time.monotonic()))
        self._ask(Request("TM", "2"))
        if not samples:
            raise LinkError("lidar", "it does not tell its time", "plug it in again")
        return samples


def _transport(address: str) -> Transport:
    if address.startswith("tcp:"):
        return TcpTransport(*host_and_port(address.removeprefix("tcp:"), TCP_PORT))
    return SerialTransport(address, "lidar")
