"""What every recording answers, whatever its format."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, Self

from hardware.hal import Command
from hardware.spec import RobotSpec
from slam.messages import Imu, LaserScan, RgbdImage, Trajectory, WheelOdometry

LARGEST_VALUE = 1e7
"""No robot is farther from its start [m] or faster [m/s, rad/s]: larger numbers are errors of a recording."""

Reading = WheelOdometry | LaserScan | Imu | RgbdImage | Command


@dataclass(frozen=True, slots=True)
class Event:
    """One reading, and when the robot came to know of it."""

    arrival: float
    """On the robot's clock [s]; never decreases from event to event."""
    channel: str
    """The queue it belongs to: `odometry`, `scans`, `imu`, `images` or `commands`."""
    message: Reading


class Log(Protocol):
    """A recording. Making one reads what is needed to vouch for it; `events` may be walked any number of times."""

    @classmethod
    def accepts(cls, path: Path, head: bytes) -> bool:
        """Whether `path`, whose first bytes are `head` (empty for a folder), is of this format."""
        ...

    @classmethod
    def load(cls, path: Path, spec: RobotSpec | None) -> Self:
        """Open a recording; a `spec` replaces what the recording says of its robot.

        Raises:
            RecordingError: it cannot be used.
        """
        ...

    @property
    def spec(self) -> RobotSpec:
        """The robot that recorded it."""
        ...

    @property
    def span(self) -> tuple[float, float]:
        """First and last arrival [s]."""
        ...

    def events(self) -> Iterator[Event]:
        """Every reading in file order.

        Raises:
            RecordingError: a reading that cannot be used.
        """
        ...

    def truth(self) -> Trajectory | None:
        """`T_world_base` over time, where the recording has it."""
        ...

    def description(self) -> str:
        """The robot's URDF, or nothing."""
        ...
