"""The twin as a `Robot`: parameters, and what they build."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal, Self

from hardware.errors import NotOpenError
from hardware.hal import Command, Health
from hardware.queues import EventQueue, Subscription
from hardware.spec import DriveSpec, RobotSpec
from sim.errors import SimError
from sim.realism import REALISMS
from sim.simulation import Simulation
from slam.messages import LaserScan, SensorFrame, Twist
from worlds.loader import load_world
from worlds.world import World


@dataclass(frozen=True, slots=True)
class Sim:
    """The PyBullet twin."""

    world: str = "aruco_room"
    """World by name, `name:option=value,...`, or a path to a .toml."""
    seed: int = 0
    """Of all noise."""
    rays: Literal["embree", "bullet"] = "embree"
    """Ray caster of the lidar; bullet is slow and the reference."""
    realism: Literal["ideal", "datasheet"] = "datasheet"
    """How far body and devices are from their specification."""
    spec: RobotSpec = field(default_factory=RobotSpec)
    """What the robot's owner believes it to be."""

    def __post_init__(self) -> None:
        if self.realism not in REALISMS:
            raise SimError(f"no realism '{self.realism}'; available: {', '.join(REALISMS)}")
        if self.rays not in ("embree", "bullet"):
            raise SimError(f"no rays '{self.rays}'; available: embree, bullet")
        if self.seed < 0:
            raise SimError(f"the seed must be 0 or above, got {self.seed}")

    def build(self) -> SimRobot:
        """Make the twin; nothing is opened yet."""
        return SimRobot(self)


class SimRobot:
    """A `Robot` and `Resettable` in PyBullet."""

    def __init__(self, parameters: Sim) -> None:
        self._parameters = parameters
        self._queues: dict[str, EventQueue[Any]] = {name: EventQueue() for name in ("odometry", "imu", "scans", "commands")}
        self._inbox: dict[str, Subscription[Any]] = {name: self._queues[name].subscribe() for name in ("odometry", "imu", "scans")}
        self._waiting: list[LaserScan] = []
        self._covered = -math.inf
        self._clock = SimClock(self)
        self._open = False
        self.simulation: Simulation | None = None
        """The running or the last episode: the door for `sim.ground_truth`, not part of the HAL."""

    @property
    def spec(self) -> RobotSpec:
        """What the robot is believed to be."""
        return self._parameters.spec

    @property
    def clock(self) -> SimClock:
        """Simulated time; zero at `open()` and `reset()`."""
        return self._clock

    @property
    def queues(self) -> dict[str, EventQueue[Any]]:
        """`odometry`, `imu`, `scans`, `commands`."""
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

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def read(self) -> SensorFrame:
        """Everything since the last read, oldest first; a scan waits until odometry covers its last beam."""
        stamp = self.running.now
        odometry, imu, scans = (tuple(self._inbox[name].take()) for name in ("odometry", "imu", "scans"))
        if odometry:
            self._covered = odometry[-1].stamp
        self._waiting.extend(scans)
        ready = tuple(scan for scan in self._waiting if scan.end <= self._covered)
        self._waiting = self._waiting[len(ready) :]
        return SensorFrame(stamp, odometry, imu, ready, self.spec.available)

    def drive(self, twist: Twist) -> Twist:
        """Command a twist of `base`; returns what is really commanded after limits."""
        simulation = self.running
        limited = (self.spec.drive or DriveSpec()).limit(twist)
        simulation.command(limited)
        self._queues["commands"].put(Command(simulation.now, limited))
        return limited

    def health(self) -> Health:
        """The body's state now; the twin has no battery."""
        dropped = sum(inbox.dropped for inbox in self._inbox.values())
        return Health(stalled=self.simulation is not None and self.simulation.stalled, link=self._open, dropped=dropped)

    def _start(self, world: World, seed: int) -> None:
        parameters = self._parameters
        self.simulation = Simulation(world, parameters.spec, REALISMS[parameters.realism], seed, parameters.rays)
        self._open = True
        self._waiting.clear()
        self._covered = -math.inf
        for name, queue in self._queues.items():
            queue.latest = None
            if name in self._inbox:
                self._inbox[name].take()


class SimClock:
    """Simulated time."""

    def __init__(self, robot: SimRobot) -> None:
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
