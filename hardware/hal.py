"""The hardware abstraction layer: one `Robot` for the twin, the real machine and a recording.

A backend is a frozen dataclass of parameters with `build() -> Robot` and one line in `hardware.registry.BACKENDS`.
The loop that serves every body:

    with robot:
        while robot.clock.sleep_until(t):
            frame = robot.read()
            estimate = pipeline.update(frame)
            robot.drive(policy(frame, estimate, pipeline.snapshot()))
            t += dt
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, Self, runtime_checkable

from hardware.queues import EventQueue
from hardware.spec import RobotSpec
from slam.messages import SensorFrame, Twist

WATCHDOG = 0.5
"""Time without a fresh command after which every body stops by itself [s]."""


@dataclass(frozen=True, slots=True)
class Command:
    """A twist as it was really commanded, after limits."""

    stamp: float
    twist: Twist


class Clock(Protocol):
    """The robot's one monotonic clock. Nothing above the HAL reads another."""

    def now(self) -> float:
        """Time since the robot's own zero [s]."""
        ...

    def sleep_until(self, t: float) -> bool:
        """Let time pass until `t` [s]. False: there is no more.

        In simulation it steps physics and lands on `t` exactly; on hardware it waits; in replay it stops at the
        next reading or at `t`, whichever comes first.
        """
        ...


@dataclass(frozen=True, slots=True)
class Health:
    """How the body is."""

    battery_volts: float | None = None
    """None where the body has no battery."""
    stalled: bool = False
    """A wheel is commanded and does not turn."""
    link: bool = True
    """The devices answer."""
    dropped: int = 0
    """Readings lost to a full queue since `open()`."""
    emergency_stop: bool = False


class Robot(Protocol):
    """A body. `open()` succeeds or holds nothing; `close()` is idempotent and always stops the wheels."""

    @property
    def spec(self) -> RobotSpec:
        """What the robot is; readable before `open()`."""
        ...

    @property
    def clock(self) -> Clock:
        """The robot's clock; it runs from `open()`."""
        ...

    @property
    def queues(self) -> Mapping[str, EventQueue[Any]]:
        """One queue per device (`odometry`, `imu`, `scans`, `commands`); a recorder subscribes here."""
        ...

    def open(self) -> None:
        """Take hold of the devices.

        Raises:
            HardwareError, or the backend's own error: a device or a world cannot be opened; nothing is held.
        """
        ...

    def close(self) -> None:
        """Stop the wheels and let go of everything. May be called twice."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *exc: object) -> None: ...

    def read(self) -> SensorFrame:
        """Everything since the last read, oldest first. Never blocks.

        A scan is held back until odometry covers its last beam.

        Raises:
            NotOpenError: outside `open()` .. `close()`.
        """
        ...

    def drive(self, twist: Twist) -> Twist:
        """Command a twist of `base`; returns what is really commanded after limits.

        Without a fresh command for `WATCHDOG` seconds the robot stops by itself. A recording returns the recorded twist.

        Raises:
            NotOpenError: outside `open()` .. `close()`.
        """
        ...

    def health(self) -> Health:
        """The body's state now."""
        ...


@runtime_checkable
class Resettable(Protocol):
    """A body that can start afresh: the twins."""

    def reset(self, seed: int) -> None:
        """Back to the start pose at time zero, with the noise of `seed`."""
        ...


@runtime_checkable
class Recorded(Protocol):
    """A body whose motion is already decided: a recording. A policy that drives is refused on it."""

    @property
    def span(self) -> tuple[float, float]:
        """First and last time on its clock [s]."""
        ...


class Backend(Protocol):
    """A frozen dataclass of parameters that builds a robot."""

    def build(self) -> Robot:
        """Make the robot; nothing is opened yet."""
        ...
