"""A simulation as a `Robot`: what all twins have in common."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any, Protocol, TypeVar, runtime_checkable

from hardware.errors import NotOpenError
from hardware.hal import Command, Health
from hardware.openable import Openable
from hardware.queues import EventQueue, Subscription
from hardware.spec import DriveSpec, RobotSpec
from sim.errors import SimError
from sim.simulation import Simulation
from slam.messages import LaserScan, RgbdImage, SensorFrame, Twist
from worlds.loader import load_world
from worlds.world import World

CHANNELS = ("odometry", "imu", "scans")
IMAGES_KEPT = 32
"""Images that wait for a reader who does not come: they are large."""
Lasting = TypeVar("Lasting", LaserScan, RgbdImage)


@runtime_checkable
class Twin(Protocol):
    """Parameters of a twin."""

    @property
    def world(self) -> str:
        """World by name, `name:option=value,...`, or a path to a .toml."""
        ...

    @property
    def seed(self) -> int:
        """Of all noise."""
        ...

    @property
    def spec(self) -> RobotSpec:
        """What the robot's owner believes it to be."""
        ...

    def simulate(self, world: World, seed: int) -> Simulation:
        """Start an episode at time zero.

        Raises:
            SimError, SpecError: it cannot be simulated; nothing is held.
        """
        ...


def require_known(seed: int, **choices: tuple[str, Collection[str]]) -> None:
    """Refuse a seed below 0 and, by what they choose, names that are not among those there are.

    Raises:
        SimError: with the names there are.
    """
    for what, (name, names) in choices.items():
        if name not in names:
            raise SimError(f"no {what} '{name}'; available: {', '.join(names)}")
    if seed < 0:
        raise SimError(f"the seed must be 0 or above, got {seed}")


class TwinRobot(Openable):
    """A `Robot` and `Resettable` over a simulation."""

    def __init__(self, parameters: Twin) -> None:
        self._parameters = parameters
        self._queues: dict[str, EventQueue[Any]] = {name: EventQueue() for name in ("odometry", "imu", "scans", "commands")}
        self._queues["images"] = EventQueue(IMAGES_KEPT)
        self._inbox: dict[str, Subscription[Any]] = {name: self._queues[name].subscribe() for name in (*CHANNELS, "images")}
        self._waiting: tuple[LaserScan, ...] = ()
        self._developing: tuple[RgbdImage, ...] = ()
        self._covered = -math.inf
        self._clock = TwinClock(self)
        self._open = False
        self.simulation: Simulation | None = None
        """The running or the last episode: the door for `sim.ground_truth`, not part of the HAL."""

    @property
    def spec(self) -> RobotSpec:
        """What the robot is believed to be."""
        return self._parameters.spec

    @property
    def clock(self) -> TwinClock:
        """Simulated time; zero at `open()` and `reset()`."""
        return self._clock

    @property
    def queues(self) -> dict[str, EventQueue[Any]]:
        """`odometry`, `imu`, `scans`, `images`, `commands`."""
        return self._queues

    @property
    def running(self) -> Simulation:
        """The episode that runs.

        Raises:
            NotOpenError: outside `open()` .. `close()`.
        """
        if not self._open or self.simulation is None:
            raise NotOpenError
        return self.simulation

    def open(self) -> None:
        """Start the physics; an open twin stays as it is.

        Raises:
            WorldError: the world cannot be read; nothing is held.
        """
        if not self._open:
            self._start(load_world(self._parameters.world), self._parameters.seed)

    def close(self) -> None:
        """Stop the physics. May be called twice."""
        self._open = False
        if self.simulation is not None:
            self.simulation.close()

    def reset(self, seed: int) -> None:
        """Back to the start pose at time zero, with the noise of `seed`; readings that nobody took are gone."""
        world = self.running.world
        self.close()
        self._start(world, seed)

    def read(self) -> SensorFrame:
        """Everything since the last read, oldest first; scans and images wait until odometry covers their end."""
        stamp = self.running.now
        odometry, imu, scans, images = (tuple(self._inbox[name].take()) for name in (*CHANNELS, "images"))
        if odometry:
            self._covered = odometry[-1].stamp
        scans, self._waiting = self._split((*self._waiting, *scans))
        images, self._developing = self._split((*self._developing, *images))
        return SensorFrame(stamp, odometry, imu, scans, self.spec.available, images)

    def drive(self, twist: Twist) -> Twist:
        """Command a twist of `base`; returns what is really commanded after limits."""
        simulation = self.running
        commanded = simulation.command((self.spec.drive or DriveSpec()).limit(twist))
        self._queues["commands"].put(Command(simulation.now, commanded))
        return commanded

    def health(self) -> Health:
        """The body's state now."""
        dropped = sum(inbox.dropped for inbox in self._inbox.values())
        volts = self.simulation.battery_volts if self.simulation is not None else None
        stalled = self.simulation is not None and self.simulation.stalled
        return Health(battery_volts=volts, stalled=stalled, link=self._open, dropped=dropped)

    def _split(self, readings: tuple[Lasting, ...]) -> tuple[tuple[Lasting, ...], tuple[Lasting, ...]]:
        """Readings that odometry covers, and the rest."""
        ready = sum(1 for reading in readings if reading.end <= self._covered)
        return readings[:ready], readings[ready:]

    def _start(self, world: World, seed: int) -> None:
        self.simulation = self._parameters.simulate(world, seed)
        self._open = True
        self._waiting, self._developing = (), ()
        self._covered = -math.inf
        for name, queue in self._queues.items():
            queue.latest = None
            if name in self._inbox:
                self._inbox[name].take()


class TwinClock:
    """Simulated time."""

    def __init__(self, robot: TwinRobot) -> None:
        self._robot = robot

    def now(self) -> float:
        """Time since `open()` or `reset()` [s]."""
        simulation = self._robot.simulation
        return simulation.now if simulation is not None else 0.0

    def sleep_until(self, t: float) -> bool:
        """Step the physics and land on `t` [s] exactly; a simulation always goes on.

        Raises:
            NotOpenError: outside `open()` .. `close()`.
            SimError: `t` is not finite.
        """
        if not math.isfinite(t):
            raise SimError(f"cannot sleep until {t}; give a finite time")
        self._robot.running.advance(t, self._robot.queues)
        return True
