"""The EV3 as wheels, encoders and gyro: one message a tick, and a dead man on the brick."""

from __future__ import annotations

import math
import struct
import time
from dataclasses import dataclass

from hardware.drivers import ev3_link
from hardware.drivers.device_thread import DeviceDriver, DeviceThread
from hardware.drivers.errors import DeviceError
from hardware.drivers.ev3_link import Answer, Ev3Link
from hardware.drivers.orders import Orders
from hardware.errors import HardwareError
from hardware.protocols import ev3_direct
from hardware.protocols.ev3_codes import Instruction, Variable
from hardware.queues import EventQueue
from hardware.spec import RobotSpec
from slam.messages import Imu, WheelOdometry
from slam.se2 import SE2

PERCENT_RATE = math.radians(ev3_direct.PERCENT_DEG)
"""1 % of a large motor's speed [rad/s]."""
RUN_ON_MS = 90
"""The brick goes on for so long after the last message; then it slows down by itself."""
DECELERATION = 32.0
"""Of a wheel that slows down by itself [rad/s^2]: from full speed to rest in 0.5 s; much faster tips the robot over."""
MODE_TIME = 2.5
"""Longest time in which the gyro changes its mode [s]."""
STALL_TIME, STALL_RATE = 0.25, 1.0
"""A wheel that should turn at this rate [rad/s] or faster and gives no count for so long [s] is stalled."""
IMPOSSIBLE = 2.0
"""More than the fastest wheel rate times this is no motion: the brick has begun to count anew."""
OUTPUTS = "ABCD"


@dataclass(frozen=True, slots=True)
class Ev3Ports:
    """What is plugged in where."""

    left: str = "A"
    """Output of the left motor."""
    right: str = "D"
    """Output of the right motor."""
    gyro: int = 4
    """Input of the gyro, 1 to 4; 0: there is none."""
    reversed: bool = False
    """The motors are mounted the other way round: counting up moves the robot backwards."""

    def __post_init__(self) -> None:
        outputs = (self.left, self.right)
        if not all(len(output) == 1 and output in OUTPUTS for output in outputs) or self.left == self.right or not 0 <= self.gyro <= 4:
            raise DeviceError(
                "EV3", f"impossible ports {self.left}, {self.right}, {self.gyro}", "name two outputs of A to D and an input of 1 to 4"
            )


@dataclass
class Ev3State:
    """What the driver last knew of the brick."""

    volts: float | None = None
    stalled: bool = False
    odometry: WheelOdometry | None = None
    counts: tuple[int, int] | None = None


class Ev3Driver(DeviceDriver):
    """Fills the queues `odometry` and `imu`, and carries out orders, from `open` to `close`."""

    def __init__(
        self, address: str, ports: Ev3Ports, spec: RobotSpec, orders: Orders, queues: tuple[EventQueue[WheelOdometry], EventQueue[Imu]]
    ) -> None:
        super().__init__(DeviceThread(f"EV3 at {address}", self._connect))
        self._address = address
        self._ports = ports
        self._spec = spec
        self._orders = orders
        self._queues = queues
        self.state = Ev3State()

    def open(self) -> None:
        """Connect, stop the wheels, set the counters to zero.

        Raises:
            DeviceError: the brick is not there, or not wired as the ports say; nothing is held.
        """
        self.state = Ev3State()
        self._orders.reset()
        self._thread.open()

    def close(self) -> None:
        """Let the wheels slow down and let go. May be called twice."""
        self._orders.halt()
        self._thread.close()

    def _connect(self) -> Ev3Session:
        link = ev3_link.connect(self._address)
        try:
            return Ev3Session(link, self._ports, self._spec, self._orders, (self._queues, self.state))
        except HardwareError:
            link.close()
            raise


class Ev3Session:
    """A connected brick. See `device_thread.Session`."""

    def __init__(
        self,
        link: Ev3Link,
        ports: Ev3Ports,
        spec: RobotSpec,
        orders: Orders,
        reports: tuple[tuple[EventQueue[WheelOdometry], EventQueue[Imu]], Ev3State],
    ) -> None:
        self._link = link
        self._spec = spec
        self._orders = orders
        (self._odometry, self._imu), self._state = reports
        self._outputs = OUTPUTS.index(ports.left), OUTPUTS.index(ports.right)
        self._sign = -1 if ports.reversed else 1
        self._gyro = ports.gyro - 1 if spec.imu is not None and ports.gyro else None
        self._drive = spec.drive
        self._moved = time.monotonic()
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
        self._due = max(self._due + (self._drive.period if self._drive else 0.02), time.monotonic())

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
        odometry = self._integrated(answer.stamp, (self._sign * left, self._sign * right))
        self._watch_for_stall(odometry, steps)
        self._state.odometry, self._state.counts = odometry, (left, right)
        self._odometry.put(odometry)
        if self._gyro is not None and math.isfinite(rate_deg):
            self._imu.put(Imu(answer.stamp, -math.radians(rate_deg)))  # the gyro counts clockwise

    def _integrated(self, stamp: float, counts: tuple[int, int]) -> WheelOdometry:
        before, drive = self._state.odometry, self._drive
        turn = math.tau / (drive.counts_per_turn if drive else 360)
        if before is None or before.wheel_angles is None or self._state.counts is None or drive is None:
            return WheelOdometry(stamp, SE2(), wheel_angles=(0.0, 0.0))
        elapsed = max(stamp - before.stamp, 1e-3)
        turned = [turn * (count - self._sign * old) for count, old in zip(counts, self._state.counts, strict=True)]
        if max(map(abs, turned)) > IMPOSSIBLE * drive.max_wheel_rate * elapsed + 2.0 * turn:
            turned = [0.0, 0.0]
        left, right = turned
        angles = before.wheel_angles[0] + left, before.wheel_angles[1] + right
        return WheelOdometry(stamp, before.T_odom_base @ drive.increment(left, right), drive.twist(left / elapsed, right / elapsed), angles)

    def _watch_for_stall(self, odometry: WheelOdometry, steps: tuple[int, int]) -> None:
        before = self._state.odometry
        pairs = zip(odometry.wheel_angles or (), (before.wheel_angles if before else None) or (), steps, strict=False)
        if not any(new == old and abs(step) * PERCENT_RATE >= STALL_RATE for new, old, step in pairs):
            self._moved = odometry.stamp
        self._state.stalled = odometry.stamp - self._moved >= STALL_TIME

    def _stop(self) -> Instruction:
        return Instruction("OUTPUT_STOP", (0, self._both(), 1))

    def _both(self) -> int:
        return sum(1 << output for output in self._outputs)


def _port(number: int) -> str:
    return f"output {OUTPUTS[number - ev3_direct.MOTOR_INPUTS]}" if number >= ev3_direct.MOTOR_INPUTS else f"input {number + 1}"
