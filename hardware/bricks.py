"""The ways to the brick: stock firmware, or ev3dev with a server of ours."""

from __future__ import annotations

from hardware.drivers.brick_driver import BrickDriver, Ev3Ports
from hardware.drivers.ev3 import PERCENT_RATE, Ev3Driver
from hardware.drivers.ev3dev import DEGREE, Ev3devDriver
from hardware.drivers.orders import Orders
from hardware.hal import Command
from hardware.queues import EventQueue
from hardware.spec import DriveSpec, RobotSpec
from slam.messages import Imu, WheelOdometry


def make_brick(
    address: str, ports: Ev3Ports, spec: RobotSpec, commands: EventQueue[Command], queues: tuple[EventQueue[WheelOdometry], EventQueue[Imu]]
) -> BrickDriver:
    """The driver for a brick at an address; nothing is opened yet.

    Args:
        address: `ev3dev:HOST[:PORT]`, or what `hardware.drivers.ev3_link.connect` takes.
        ports: what is plugged in where.
        spec: the robot, with a drive.
        commands: learns what is really commanded.
        queues: of odometry and gyro, are filled.
    """
    kind, step = (Ev3devDriver, DEGREE) if address.startswith("ev3dev:") else (Ev3Driver, PERCENT_RATE)
    return kind(address, ports, spec, Orders(spec.drive or DriveSpec(), step, commands), queues)
