"""What the wheels are told: the one place of limits, acceleration and watchdog on the real robot."""

from __future__ import annotations

import threading

from hardware.hal import WATCHDOG, Command
from hardware.queues import EventQueue
from hardware.spec import DriveSpec
from slam.messages import Twist

ACCELERATION = 20.0
"""Of a wheel [rad/s^2]; twice as much lifts the caster."""


class Orders:
    """The latest command, given by one thread and carried out by another."""

    def __init__(self, drive: DriveSpec, step: float, commands: EventQueue[Command]) -> None:
        """Stand still.

        Args:
            drive: the limits.
            step: wheel rates are whole multiples of this [rad/s].
            commands: learns what is really commanded.
        """
        self._drive = drive
        self._step = step
        self._commands = commands
        self._lock = threading.Lock()
        self._twist = Twist()
        self._given = -WATCHDOG
        self._rates = [0.0, 0.0]
        self._told = 0.0

    def give(self, twist: Twist, now: float) -> Twist:
        """Command a twist at `now` [s]; returns what is really commanded."""
        commanded = self._drive.possible(self._drive.limit(twist), self._step)
        with self._lock:
            self._twist, self._given = commanded, now
        self._commands.put(Command(now, commanded))
        return commanded

    def steps(self, now: float) -> tuple[int, int]:
        """Rates for the (left, right) wheel at `now` [s], in steps: on the way to the command, or to rest without a fresh one."""
        with self._lock:
            late = self._twist != Twist() and now - self._given > WATCHDOG
            if late:
                self._twist = Twist()
            goals = self._drive.wheel_rates(self._twist)
        if late:
            self._commands.put(Command(now, Twist()))
        change = ACCELERATION * min(max(now - self._told, 0.0), 0.1)
        self._told = now
        self._rates = [rate + min(max(goal - rate, -change), change) for rate, goal in zip(self._rates, goals, strict=True)]
        left, right = (round(rate / self._step) for rate in self._rates)
        return left, right

    def halt(self) -> None:
        """Slow down to rest."""
        with self._lock:
            self._twist = Twist()

    def reset(self) -> None:
        """The wheels stand."""
        self.halt()
        self._rates = [0.0, 0.0]
