"""From the counters of two motors to odometry: what every way to the brick has in common."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hardware.queues import EventQueue
from hardware.spec import DriveSpec
from slam.messages import WheelOdometry
from slam.se2 import SE2

STALL_TIME, STALL_RATE = 0.25, 1.0
"""A wheel that should turn at this rate [rad/s] or faster and gives no count for so long [s] is stalled."""
IMPOSSIBLE = 2.0
"""More than the fastest wheel rate times this is no motion: the brick has begun to count anew."""


@dataclass
class BrickState:
    """What the driver last knew of the brick."""

    volts: float | None = None
    stalled: bool = False
    odometry: WheelOdometry | None = None
    counts: tuple[int, int] | None = None


class WheelCounter:
    """Integrates counts into a state that outlives the link."""

    def __init__(self, drive: DriveSpec, sign: int, state: BrickState, odometry: EventQueue[WheelOdometry], now: float) -> None:
        """Begin at `now` [s]; `sign` -1 where counting up is backwards."""
        self._drive = drive
        self._sign = sign
        self._state = state
        self._odometry = odometry
        self._moved = now

    def report(self, stamp: float, counts: tuple[int, int], told: tuple[float, float]) -> None:
        """Pass on what the counters (left, right) say at `stamp` [s] of wheels that were told to turn [rad/s]."""
        odometry = self._integrated(stamp, counts)
        self._watch_for_stall(odometry, told)
        self._state.odometry, self._state.counts = odometry, counts
        self._odometry.put(odometry)

    def _integrated(self, stamp: float, counts: tuple[int, int]) -> WheelOdometry:
        before, drive = self._state.odometry, self._drive
        turn = math.tau / drive.counts_per_turn
        if before is None or before.wheel_angles is None or self._state.counts is None:
            return WheelOdometry(stamp, SE2(), wheel_angles=(0.0, 0.0))
        elapsed = max(stamp - before.stamp, 1e-3)
        turned = [turn * self._sign * (count - old) for count, old in zip(counts, self._state.counts, strict=True)]
        if max(map(abs, turned)) > IMPOSSIBLE * drive.max_wheel_rate * max(elapsed, drive.period) + 2.0 * turn:
            turned = [0.0, 0.0]
        left, right = turned
        angles = before.wheel_angles[0] + left, before.wheel_angles[1] + right
        return WheelOdometry(stamp, before.T_odom_base @ drive.increment(left, right), drive.twist(left / elapsed, right / elapsed), angles)

    def _watch_for_stall(self, odometry: WheelOdometry, told: tuple[float, float]) -> None:
        before = self._state.odometry
        pairs = zip(odometry.wheel_angles or (), (before.wheel_angles if before else None) or (), told, strict=False)
        if not any(new == old and abs(rate) >= STALL_RATE for new, old, rate in pairs):
            self._moved = odometry.stamp
        self._state.stalled = odometry.stamp - self._moved >= STALL_TIME
