"""The EV3 with ev3dev: talks to `hardware.drivers.ev3dev_server`, which runs on the brick."""

from __future__ import annotations

import math
import time

from hardware.drivers.brick_driver import BrickDriver, BrickReports, Ev3Ports
from hardware.drivers.device_clock import DeviceClock
from hardware.drivers.errors import DeviceError, LinkError
from hardware.drivers.orders import Orders
from hardware.drivers.transport import TcpTransport, Transport, host_and_port
from hardware.drivers.wheel_counter import WheelCounter
from hardware.errors import HardwareError
from hardware.spec import DriveSpec, RobotSpec
from slam.messages import Imu

DEGREE = math.radians(1.0)
"""Speeds are whole degrees a second [rad/s]."""
TCP_PORT = 5556
ANSWER_TIME = 0.5
"""Longest wait for an answer [s]."""
LONGEST_LINE = 256


class Ev3devDriver(BrickDriver):
    """Fills the queues `odometry` and `imu`, and carries out orders, from `open` to `close`."""

    def _connect(self) -> Ev3devSession:
        transport = TcpTransport(*host_and_port(self.address.removeprefix("ev3dev:"), TCP_PORT))
        try:
            return Ev3devSession(transport, self.ports, self.spec, self.orders, self.reports)
        except HardwareError:
            transport.close()
            raise


class Ev3devSession:
    """A connected brick. See `device_thread.Session`."""

    def __init__(self, transport: Transport, ports: Ev3Ports, spec: RobotSpec, orders: Orders, reports: BrickReports) -> None:
        self._transport = transport
        self._orders = orders
        self._reports = reports
        self._drive = spec.drive or DriveSpec()
        self._sign = -1 if ports.reversed else 1
        self._clock = DeviceClock()
        self._pending = b""
        gyro = ports.gyro if spec.imu is not None else 0
        if (answer := self._ask(f"ports {ports.left} {ports.right} {gyro}")) != "ok":
            raise DeviceError("EV3", f"it refuses its ports ({answer})", "plug in what robot.toml says, or correct [ports] in it")
        self._counter = WheelCounter(self._drive, self._sign, reports.state, reports.odometry, time.monotonic())
        self._due = time.monotonic()

    def step(self) -> None:
        """See `Session`: one question, at its time."""
        wait = self._due - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
        sent = time.monotonic()
        left, right = self._orders.steps(sent)
        answer = self._ask(f"{self._sign * left} {self._sign * right}")
        self._report(answer, sent, (left * DEGREE, right * DEGREE))
        self._due = max(self._due + self._drive.period, time.monotonic())

    def close(self) -> None:
        """See `Session`: the brick slows the wheels down by itself."""
        self._transport.close()

    def _report(self, answer: str, sent: float, told: tuple[float, float]) -> None:
        received = time.monotonic()
        try:
            left, right, rate, microvolts, time_us = answer.split()
            counts, brick, volts = (int(left), int(right)), 1e-6 * int(time_us), 1e-6 * int(microvolts)
            rate_deg = None if rate == "none" else int(rate)
        except ValueError as error:
            raise LinkError("EV3", f"it answers '{answer}'", "restart its server: twin install") from error
        self._clock.observe(sent, brick, received)
        stamp = min(max(self._clock.host_time(brick), sent), received)  # a new offset must not turn the time back
        self._reports.state.volts = volts
        self._counter.report(stamp, counts, told)
        if rate_deg is not None:
            self._reports.imu.put(Imu(stamp, -math.radians(rate_deg)))  # the gyro counts clockwise

    def _ask(self, line: str) -> str:
        """The answer to a line.

        Raises:
            LinkError: there is none.
        """
        self._transport.write(line.encode("ascii") + b"\n")
        end = time.monotonic() + ANSWER_TIME
        while b"\n" not in self._pending and (left := end - time.monotonic()) > 0.0 and len(self._pending) < LONGEST_LINE:
            self._pending += self._transport.read(left)
        answer, found, self._pending = self._pending.partition(b"\n")
        if not found:
            raise LinkError("EV3", "its server does not answer", "start it: twin install")
        said, _, total = answer.rpartition(b" *")
        if total != b"%02X" % (sum(said) % 256):
            raise LinkError("EV3", f"it answers '{answer.decode('ascii', 'replace')}'", "restart its server: twin install")
        return said.decode("ascii", "replace")
