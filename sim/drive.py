"""The EV3's motors and encoders."""

from __future__ import annotations

import math

from hardware.spec import DriveSpec
from sim.motion import NANOSECONDS, STEP, WHEELS, Motion
from slam.messages import WheelOdometry
from slam.se2 import SE2

TORQUE = 0.20
"""Running torque of the EV3 large motor [N m] (LEGO's data sheet)."""
TIME_CONSTANT = 0.05
"""Of the speed regulator [s]: its duty needs some 20 ticks of 2 ms to climb to 30 %."""
MAX_ACCELERATION = 40.0
"""Of a wheel [rad/s^2]; more would lift the caster."""
STALL_TIME = 0.2
"""A wheel that should turn and gives no encoder edge for so long is stalled [s]."""
STALL_RATE = 1.0
"""Slowest wheel rate that counts as "should turn" [rad/s]."""

Pair = tuple[float, float]


class Motors:
    """The regulators of both wheels: a commanded rate is approached with a first-order lag and limited acceleration."""

    def __init__(self, max_rate: float) -> None:
        self._max_rate = max_rate
        self._targets: Pair = (0.0, 0.0)
        self.rates: Pair = (0.0, 0.0)
        """Wheel rates that the motors are set to now (left, right) [rad/s]."""

    def command(self, rates: Pair) -> None:
        """Set the wheel rates to reach (left, right) [rad/s]."""
        self._targets = (self._limited(rates[0]), self._limited(rates[1]))

    def tick(self) -> bool:
        """One physics step; whether the rates have changed."""
        if self.rates == self._targets:
            return False
        self.rates = (_approach(self.rates[0], self._targets[0]), _approach(self.rates[1], self._targets[1]))
        return True

    def _limited(self, rate: float) -> float:
        return min(max(rate, -self._max_rate), self._max_rate)


class Odometer:
    """Encoders that count whole steps, integrated with the radii and the track of the specification."""

    def __init__(self, spec: DriveSpec) -> None:
        self._spec = spec
        self._readings = 0
        self._angles: Pair = (0.0, 0.0)
        self._T_odom_base = SE2()
        self._still = [0.0, 0.0]

    @property
    def due(self) -> float:
        """Time of the next reading [s]."""
        return round(self._readings * self._spec.period, NANOSECONDS)

    @property
    def stalled(self) -> bool:
        """Whether a wheel should turn and has given no edge for `STALL_TIME`."""
        return max(self._still) >= STALL_TIME

    def read(self, motion: Motion, rates: Pair) -> WheelOdometry:
        """The reading that is due, while the motors are set to `rates` (left, right) [rad/s]."""
        stamp, row = self.due, motion.row_at(self.due)
        angles = (self._quantised(float(row[WHEELS])), self._quantised(float(row[WHEELS + 1])))
        turned = (angles[0] - self._angles[0], angles[1] - self._angles[1])
        for wheel in (0, 1):
            waiting = turned[wheel] == 0.0 and abs(rates[wheel]) >= STALL_RATE
            self._still[wheel] = self._still[wheel] + self._spec.period if waiting else 0.0
        self._T_odom_base = self._T_odom_base @ self._spec.increment(*turned)
        self._angles = angles
        self._readings += 1
        twist = self._spec.twist(turned[0] / self._spec.period, turned[1] / self._spec.period)
        return WheelOdometry(stamp, self._T_odom_base, twist, angles)

    def _quantised(self, angle: float) -> float:
        # Half a count: the wheels start in the middle of one, or settling on the floor would show as a whole count.
        counts = math.floor(angle * self._spec.counts_per_turn / math.tau + 0.5)
        return counts * (math.tau / self._spec.counts_per_turn)


def _approach(rate: float, target: float) -> float:
    change = (target - rate) * -math.expm1(-STEP / TIME_CONSTANT)
    limit = MAX_ACCELERATION * STEP
    return target if abs(target - rate) < 1e-6 else rate + min(max(change, -limit), limit)
