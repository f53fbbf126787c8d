"""What every way to the brick has in common: its ports, its orders, what it reports."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

from hardware.drivers.device_thread import DeviceDriver, DeviceThread, Session
from hardware.drivers.errors import DeviceError
from hardware.drivers.orders import Orders
from hardware.drivers.wheel_counter import BrickState
from hardware.queues import EventQueue
from hardware.spec import RobotSpec
from slam.messages import Imu, WheelOdometry

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


class BrickReports(NamedTuple):
    """Where a session leaves what it learns."""

    odometry: EventQueue[WheelOdometry]
    imu: EventQueue[Imu]
    state: BrickState


class BrickDriver(DeviceDriver):
    """Fills the queues `odometry` and `imu`, and carries out orders, from `open` to `close`."""

    def __init__(
        self, address: str, ports: Ev3Ports, spec: RobotSpec, orders: Orders, queues: tuple[EventQueue[WheelOdometry], EventQueue[Imu]]
    ) -> None:
        super().__init__(DeviceThread(f"EV3 at {address}", self._connect))
        self.address = address
        self.ports = ports
        self.spec = spec
        self.orders = orders
        self.reports = BrickReports(*queues, BrickState())

    @property
    def state(self) -> BrickState:
        """What is known of the brick."""
        return self.reports.state

    def open(self) -> None:
        """Connect, stop the wheels.

        Raises:
            DeviceError: the brick is not there, or not wired as the ports say; nothing is held.
        """
        self.reports = self.reports._replace(state=BrickState())
        self.orders.reset()
        self._thread.open()

    def close(self) -> None:
        """Let the wheels slow down and let go. May be called twice."""
        self.orders.halt()
        self._thread.close()

    @abstractmethod
    def _connect(self) -> Session:
        """The brick, found.

        Raises:
            HardwareError: it is not; nothing is held.
        """
