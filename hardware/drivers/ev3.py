"""The EV3 as wheels, encoders and gyro: one message a tick, and a dead man on the brick."""

from __future__ import annotations

import math
import struct
import time

from hardware.drivers import ev3_link
from hardware.drivers.brick_driver import OUTPUTS, BrickDriver, BrickReports, Ev3Ports
from hardware.drivers.errors import DeviceError
from hardware.drivers.ev3_link import Answer, Ev3Link
from hardware.drivers.orders import Orders
from hardware.drivers.wheel_counter import WheelCounter
from hardware.errors import HardwareError
from hardware.protocols import ev3_direct
from hardware.protocols.ev3_codes import Instruction, Variable
from hardware.spec import DriveSpec, RobotSpec
from slam.messages import Imu

PERCENT_RATE = math.radians(ev3_direct.PERCENT_DEG)
"""1 % of a large motor's speed [rad/s]."""
RUN_ON_MS = 90
"""The brick goes on for so long after the last message; then it slows down by itself."""
DECELERATION = 32.0
"""Of a wheel that slows down by itself [rad/s^2]: from full speed to rest in 0.5 s; much faster tips the robot over."""
MODE_TIME = 2.5
"""Longest time in which the gyro changes its mode [s]."""


class Ev3Driver(BrickDriver):
    """Talks to the stock firmware."""

    def _connect(self) -> Ev3Session:
        link = ev3_link.connect(self.address)
        try:
            return Ev3Session(link, self.ports, self.spec, self.orders, self.reports)
        except HardwareError:
            link.close()
            raise


class Ev3Session:
    """A connected brick. See `device_thread.Session`."""

    def __init__(self, link: Ev3Link, ports: Ev3Ports, spec: RobotSpec, orders: Orders, reports: BrickReports) -> None:
        self._link = link
        self._orders = orders
        self._imu, self._state = reports.imu, reports.state
        self._outputs = OUTPUTS.index(ports.left), OUTPUTS.index(ports.right)
        self._sign = -1 if ports.reversed else 1
        self._gyro = ports.gyro - 1 if spec.imu is not None and ports.gyro else None
        self._drive = spec.drive or DriveSpec()
        self._counter = WheelCounter(self._drive, self._sign, reports.state, reports.odometry, time.monotonic())
        self._steps = (0, 0)
        self._set_up()
        self._due = time.monotonic()

    def step(self) -> None:
        """See `Session`: one message, at its time."""
        wait = self._due - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
        now = time.monotonic()
        steps = self._orders.steps(now)
        self._steps = steps
        answer = self._link.ask(*self._movement(steps), *self._questions(), global_bytes=16)
        self._report(answer, steps)
        self._due = max(self._due + self._drive.period, time.monotonic())

    def close(self) -> None:
        """See `Session`."""
        try:
            self._link.ask(*(self._run(self._steps, 0) if any(self._steps) else [self._stop()]))
        except HardwareError:  # the link is broken: the dead man on the brick stops the wheels
            pass
        finally:
            self._link.close()

    def _set_up(self) -> None:
        """Look who is there, choose the gyro's mode. A brick that was lost slows down by itself, an abrupt stop would tip it over."""
        if self._state.counts is None:
            self._link.ask(self._stop())
        inputs = [ev3_direct.MOTOR_INPUTS + output for output in self._outputs] + ([self._gyro] if self._gyro is not None else [])
        looks = [Instruction("INPUT_GET_TYPEMODE", (0, number, Variable(2 * k), Variable(2 * k + 1))) for k, number in enumerate(inputs)]
        types = self._link.ask(*looks, global_bytes=2 * len(inputs)).values[::2]
        wanted = (*(ev3_direct.LARGE_MOTOR,) * 2, ev3_direct.GYRO)
        for number, found, kind in zip(inputs, types, wanted, strict=False):
            if found != kind:
                what = f"{_port(number)} has type {found} plugged in where type {kind} is needed"
                raise DeviceError(
                    "EV3", what, "plug a large motor (7) into both outputs and the gyro (32) into its input, or name other ports"
                )
        if self._gyro is not None:
            mode = Instruction("INPUT_READY_SI", (0, self._gyro, ev3_direct.GYRO, ev3_direct.GYRO_RATE, 1, Variable(0)))
            self._link.ask(mode, global_bytes=4, timeout=MODE_TIME)
        if self._state.counts is None:
            self._link.ask(Instruction("OUTPUT_CLR_COUNT", (0, self._both())))

    def _movement(self, steps: tuple[int, int]) -> list[Instruction]:
        """Runs on for a while and then stops by itself, should nothing else come."""
        if steps == (0, 0):
            return [self._stop()]
        return self._run(steps, RUN_ON_MS)

    def _run(self, steps: tuple[int, int], duration_ms: int) -> list[Instruction]:
        """Keep the speeds for a while, then slow down and brake."""
        slow_down_ms = round(1e3 * max(map(abs, steps)) * PERCENT_RATE / DECELERATION)
        return [
            Instruction("OUTPUT_TIME_SPEED", (0, 1 << output, self._sign * percent, 0, duration_ms, slow_down_ms, 1))
            for output, percent in zip(self._outputs, steps, strict=True)
        ]

    def _questions(self) -> list[Instruction]:
        counts = [Instruction("OUTPUT_GET_COUNT", (0, output, Variable(4 * k))) for k, output in enumerate(self._outputs)]
        volts = Instruction("UI_READ_GET_VBATT", (Variable(12),))
        if self._gyro is None:
            return [*counts, volts]
        return [*counts, Instruction("INPUT_READSI", (0, self._gyro, ev3_direct.GYRO, ev3_direct.GYRO_RATE, Variable(8))), volts]

    def _report(self, answer: Answer, steps: tuple[int, int]) -> None:
        left, right, rate_deg, volts = struct.unpack("<iiff", answer.values)
        self._state.volts = volts if math.isfinite(volts) and volts > 0.0 else self._state.volts
        self._counter.report(answer.stamp, (left, right), (steps[0] * PERCENT_RATE, steps[1] * PERCENT_RATE))
        if self._gyro is not None and math.isfinite(rate_deg):
            self._imu.put(Imu(answer.stamp, -math.radians(rate_deg)))  # the gyro counts clockwise

    def _stop(self) -> Instruction:
        return Instruction("OUTPUT_STOP", (0, self._both(), 1))

    def _both(self) -> int:
        return sum(1 << output for output in self._outputs)


def _port(number: int) -> str:
    return f"output {OUTPUTS[number - ev3_direct.MOTOR_INPUTS]}" if number >= ev3_direct.MOTOR_INPUTS else f"input {number + 1}"
