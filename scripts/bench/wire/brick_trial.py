"""A driver of the brick on a wire to an emulator whose wheels are known."""

from __future__ import annotations

import math
import time
from contextlib import ExitStack

from hardware.bricks import make_brick
from hardware.drivers.brick_driver import Ev3Ports
from hardware.drivers.transport import host_and_port
from hardware.emulators.channels import TcpChannel
from hardware.emulators.ev3_brick import Ev3Brick
from hardware.emulators.ev3dev_brick import Ev3devBrick
from hardware.emulators.port import Port
from hardware.emulators.relay import Relay
from hardware.queues import EventQueue
from hardware.spec import DriveSpec, RobotSpec
from scripts.bench.wire.trial import Trial
from sim.wire import Wiring
from slam.messages import Imu, Twist, WheelOdometry

GENTLE = Twist(0.05, 0.25)
"""A circle of 0.2 m."""
SLACK_DEG, SLACK = 2.0, 0.05
"""Counts are whole degrees, and stamps may be off by so much [s]."""
REMEMBERED = 0.4
"""So long the twin knows its wheels' angles [s]."""


class BrickTrial(Trial):
    """Drives a circle."""

    def __init__(self, name: str) -> None:
        """`ev3dev` for the server on the brick, anything else is the stock firmware over TCP."""
        super().__init__(name)
        self._wiring = Wiring()
        self._zero_deg: tuple[float, float] | None = None

    def _connect(self, held: ExitStack) -> None:
        self.port = held.enter_context(self._port(held))
        odometry, imu = EventQueue[WheelOdometry](), EventQueue[Imu]()
        self._inbox = odometry.subscribe()
        address = self.port.address if self.name != "ev3dev" else self.port.address.replace("tcp:", "ev3dev:")
        self.driver = make_brick(address, Ev3Ports(), RobotSpec(), EventQueue(), (odometry, imu))
        held.callback(self.driver.close)
        self.driver.open()

    def look(self) -> None:
        """Go on driving, and judge what has come: wheels that have turned otherwise than the twin's are wrong."""
        now = time.monotonic()
        self.driver.orders.give(GENTLE, now)
        for reading in self._inbox.take():
            if now - reading.stamp < REMEMBERED:
                self._judge(reading)
            self.newest = reading.stamp

    def _judge(self, reading: WheelOdometry) -> None:
        assert reading.wheel_angles is not None
        left, right = (self.twin.angle_deg(output, reading.stamp) for output in (self._wiring.left, self._wiring.right))
        said_deg = math.degrees(reading.wheel_angles[0]), math.degrees(reading.wheel_angles[1])
        if self._zero_deg is None:
            self._zero_deg = left - said_deg[0], right - said_deg[1]
        slack_deg = SLACK_DEG + SLACK * math.degrees(max(DriveSpec().wheel_rates(GENTLE)))
        off = max(abs(left - said_deg[0] - self._zero_deg[0]), abs(right - said_deg[1] - self._zero_deg[1]))
        self.wrong += off > slack_deg

    def _port(self, held: ExitStack) -> Port:
        if self.name != "ev3dev":
            return Port(Ev3Brick(self.twin), TcpChannel())
        brick = held.enter_context(Ev3devBrick(self.twin))
        relay = Relay(*host_and_port(brick.address.removeprefix("ev3dev:"), 0))
        held.callback(relay.close)
        return Port(relay, TcpChannel())
