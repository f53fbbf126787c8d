"""A robot around a robot, with things going wrong in between."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from hardware.fault_kinds import Case, Fault, HostStall, Reading, ReadingFault, StuckWheel
from hardware.hal import Command, Health, Recorded, Resettable, Robot
from hardware.openable import Openable
from hardware.queues import EventQueue
from hardware.spec import RobotSpec
from slam.messages import SensorFrame, Twist


class FaultyRobot(Openable):
    """Implements `Robot`. Readings pass the faults when the robot is read, and come to its queues then."""

    def __init__(self, body: Robot, faults: Sequence[Fault], seed: int) -> None:
        self.body = body
        """The robot itself: for the truth about a twin."""
        self._stuck = [fault for fault in faults if isinstance(fault, StuckWheel)]
        self._stalls = [fault for fault in faults if isinstance(fault, HostStall)]
        self._faults: list[ReadingFault] = [fault for fault in faults if not isinstance(fault, StuckWheel | HostStall)]
        self._seed = seed
        self._queues: dict[str, EventQueue[Any]] = {channel: EventQueue[Any]() for channel in body.queues}
        self._commands = body.queues["commands"].subscribe()
        self._clock = FaultyClock(self)
        self._rngs: list[np.random.Generator] = []
        self._previous: dict[str, Reading] = {}
        self._commanded = Twist()
        self._open = False
        self._begin()

    @property
    def spec(self) -> RobotSpec:
        """The body's."""
        return self.body.spec

    @property
    def clock(self) -> FaultyClock:
        """The body's, in which the host may pause."""
        return self._clock

    @property
    def queues(self) -> dict[str, EventQueue[Any]]:
        """The body's channels, with what comes through."""
        return self._queues

    @property
    def elapsed(self) -> float:
        """Time since `open()` [s]."""
        return self.body.clock.now() - self._start

    def open(self) -> None:
        """Open the body, and begin with the faults; an open one stays as it is."""
        if not self._open:
            self.body.open()
            self._open = True
            self._begin()

    def close(self) -> None:
        """Close the body. May be called twice."""
        self._open = False
        self.body.close()
        self.pass_commands()

    def read(self) -> SensorFrame:
        """The body's frame, as far as it comes through."""
        frame = self.body.read()
        channels = [channel for channel in self._queues if hasattr(frame, channel)]
        return replace(frame, **{channel: self._delivered(channel, getattr(frame, channel)) for channel in channels})

    def drive(self, twist: Twist) -> Twist:
        """Command the body; returns what it is told, though a stuck wheel does not turn."""
        hindered = self._hindered(twist)
        if hindered is None:
            self._commanded = self.body.drive(twist)
            self.pass_commands()
        else:
            self.pass_commands()
            self.body.drive(hindered)
            self._commands.take()
            self._commanded = self.spec.drive.limit(twist) if self.spec.drive else twist
            self._queues["commands"].put(Command(self.body.clock.now(), self._commanded))
        return self._commanded

    def health(self) -> Health:
        """The body's; a stuck wheel that should turn is a stall."""
        health = self.body.health()
        stuck = self._commanded != Twist() and any(fault.covers(self.elapsed) for fault in self._stuck)
        return replace(health, stalled=health.stalled or stuck)

    def pass_commands(self) -> None:
        """Hand on what the body has done by itself."""
        for command in self._commands.take():
            self._commanded = command.twist
            self._queues["commands"].put(command)

    def paused_until(self, since: float) -> float:
        """When the host wakes again if a pause has begun after `since` [s since `open()`]; -inf: it is awake."""
        begun = [stall for stall in self._stalls if since <= stall.start < self.elapsed]
        return max((self._start + stall.start + stall.duration for stall in begun), default=-math.inf)

    def _begin(self) -> None:
        self._start = self.body.clock.now()
        self._rngs = [np.random.default_rng(np.random.SeedSequence(self._seed, spawn_key=(k,))) for k in range(len(self._faults))]
        self._previous.clear()
        self._commanded = Twist()
        self._commands.take()
        for queue in self._queues.values():
            queue.latest = None

    def _delivered(self, channel: str, readings: tuple[Any, ...]) -> tuple[Any, ...]:
        delivered = [reading for reading in (self._spoilt(channel, reading) for reading in readings) if reading is not None]
        for reading in delivered:
            self._queues[channel].put(reading)
        return tuple(delivered)

    def _spoilt(self, channel: str, reading: Reading) -> Reading | None:
        elapsed, spoilt = reading.stamp - self._start, reading
        for fault, rng in zip(self._faults, self._rngs, strict=True):
            if fault.channel == channel and fault.covers(elapsed):
                spoilt = fault.spoil(spoilt, Case(elapsed, self._previous.get(channel), rng))
                if spoilt is None:
                    return None
        self._previous[channel] = spoilt
        return spoilt

    def _hindered(self, twist: Twist) -> Twist | None:
        """What the body does when a wheel is stuck; None: as told."""
        drive = self.spec.drive
        stuck = {fault.wheel for fault in self._stuck if fault.covers(self.elapsed)}
        if drive is None or not stuck:
            return None
        left, right = drive.wheel_rates(drive.limit(twist))
        slow = drive.twist(0.0 if "left" in stuck else left, 0.0 if "right" in stuck else right)
        share = min(1.0, drive.max_yaw_rate / max(abs(slow.omega), 1e-9))  # or the limits would turn the stuck wheel
        return Twist(slow.v * share, slow.omega * share)


class ResettableRobot(Robot, Resettable, Protocol):
    """A twin."""


class FaultyTwin(FaultyRobot):
    """A `FaultyRobot` that is `Resettable`."""

    def __init__(self, body: ResettableRobot, faults: Sequence[Fault], seed: int) -> None:
        super().__init__(body, faults, seed)
        self._twin = body

    def reset(self, seed: int) -> None:
        """Reset the body with the noise of `seed`; the faults begin anew, with their own."""
        self._twin.reset(seed)
        self._begin()


class RecordedRobot(Robot, Recorded, Protocol):
    """A recording."""


class FaultyRecording(FaultyRobot):
    """A `FaultyRobot` that is `Recorded`."""

    def __init__(self, body: RecordedRobot, faults: Sequence[Fault], seed: int) -> None:
        super().__init__(body, faults, seed)
        self._recording = body

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of the recording [s]."""
        return self._recording.span


class FaultyClock:
    """The body's clock, seen from a host that pauses."""

    def __init__(self, robot: FaultyRobot) -> None:
        self._robot = robot

    def now(self) -> float:
        """The body's time [s]."""
        return self._robot.body.clock.now()

    def sleep_until(self, t: float) -> bool:
        """Sleep, and oversleep when the host pauses on the way. False: there is no more."""
        clock, before = self._robot.body.clock, self._robot.elapsed
        more, wakes = clock.sleep_until(t), self._robot.paused_until(before)
        while more and clock.now() < wakes:
            more = clock.sleep_until(wakes)
        self._robot.pass_commands()
        return more
