"""The wheels' motors, perfect and as the EV3 has them, and the encoders."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from hardware.spec import DriveSpec
from sim import motor_kernel, rolling_kernel
from sim.drive_errors import DriveErrors
from sim.motion import NANOSECONDS, STEP, WHEELS, Motion
from slam.messages import WheelOdometry
from slam.se2 import SE2

TORQUE = 0.20
"""Running torque of the EV3 large motor [N m] (LEGO's data sheet)."""
TIME_CONSTANT = 0.05
"""Of a perfect motor's way to its rate [s]."""
LAG = -math.expm1(-STEP / TIME_CONSTANT)
"""Share of that way in one step."""
MAX_ACCELERATION = 40.0
"""Of a perfect motor's wheel [rad/s^2]; more would lift the caster."""
STALL_TIME = 0.2
"""A wheel that should turn and gives no encoder edge for so long is stalled [s]."""
STALL_RATE = 1.0
"""Slowest wheel rate that counts as "should turn" [rad/s]."""

Pair = tuple[float, float]
AT_REST: Pair = (0.0, 0.0)


class Wheels(NamedTuple):
    """How the wheels are; every pair is (left, right)."""

    angles: Pair = AT_REST
    """[rad]"""
    rates: Pair = AT_REST
    """[rad/s]"""
    loads: Pair = AT_REST
    """Torque that turned them in the last step [N m]."""


class Drive(Protocol):
    """What turns the wheels; every pair is (left, right)."""

    @property
    def goals(self) -> Pair:
        """Wheel rates that are commanded [rad/s]."""
        ...

    @property
    def rates(self) -> Pair:
        """Wheel rates to give to the wheels now [rad/s]."""
        ...

    @property
    def torques(self) -> Pair:
        """With these torques at most [N m]."""
        ...

    @property
    def encoders(self) -> Pair | None:
        """What the encoders turn with [rad]; None: with the wheels."""
        ...

    @property
    def step(self) -> float:
        """Commanded rates are whole multiples of this [rad/s]; 0: any."""
        ...

    @property
    def volts(self) -> float | None:
        """Of the battery; None: there is none."""
        ...

    def command(self, goals: Pair) -> None:
        """Set the wheel rates to reach [rad/s]."""
        ...

    def tick(self, wheels: Wheels) -> bool:
        """One physics step; whether `rates` or `torques` may have changed."""
        ...


class Motors:
    """Perfect motors: a commanded rate is approached with a first-order lag and limited acceleration."""

    torques = (TORQUE, TORQUE)
    encoders = None
    step = 0.0
    volts = None

    def __init__(self, max_rate: float) -> None:
        self._max_rate = max_rate
        self.goals = AT_REST
        self.rates = AT_REST

    def command(self, goals: Pair) -> None:
        """See `Drive`."""
        self.goals = (self._limited(goals[0]), self._limited(goals[1]))

    def tick(self, wheels: Wheels) -> bool:
        """See `Drive`."""
        if self.rates == self.goals:
            return False
        self.rates = rolling_kernel.approached(self.rates, self.goals, LAG, MAX_ACCELERATION * STEP)
        return True

    def _limited(self, rate: float) -> float:
        return min(max(rate, -self._max_rate), self._max_rate)


class RegulatedMotors:
    """Two EV3 large motors under the firmware's regulator, on one battery that empties and sags."""

    step = motor_kernel.PERCENT_RATE

    def __init__(self, errors: DriveErrors) -> None:
        charge, empty, full = errors.battery_charge, errors.battery_empty, errors.battery
        self.volts = empty + max(charge, 0.0) * (full - empty)
        brick = np.array([*AT_REST, charge, self.volts])
        self._states = np.zeros((2, 2)), np.zeros((2, motor_kernel.STATES), np.int64), brick
        motor = (errors.resistance, errors.back_emf, errors.torque_constant, errors.friction, errors.rotor_inertia)
        self._motor = (*motor, errors.backlash, errors.axle_friction, errors.ramp)
        self._battery = (empty, full, errors.battery_capacity, errors.battery_resistance, errors.brick_current)
        self._ticks = 0
        self.goals = AT_REST
        self.rates = AT_REST
        self.torques = AT_REST
        self.encoders = AT_REST
        """See `Drive`: they sit on the motors, before the gears."""

    def command(self, goals: Pair) -> None:
        """See `Drive`; what the brick's program asks of the regulators runs up or down to it, in whole percent."""
        self.goals = goals

    def tick(self, wheels: Wheels) -> bool:
        """See `Drive`."""
        if self._ticks == 0:
            self._states[0][:, motor_kernel.ANGLE] = wheels.angles
        self._ticks += 1
        now, before = int(self._ticks * STEP * motor_kernel.TIMER), (self.rates, self.torques)
        motion = (*wheels.angles, *wheels.rates, *wheels.loads)
        left, right, *torques, first, second, self.volts = motor_kernel.tick(
            self._states, self.goals, motion, self._motor, self._battery, now
        )
        self.rates, self.torques, self.encoders = (left, right), (torques[0], torques[1]), (first, second)
        return before != (self.rates, self.torques)


def make_drive(spec: DriveSpec, errors: DriveErrors) -> Drive:
    """Perfect motors, or regulated ones."""
    return RegulatedMotors(errors) if errors.regulator else Motors(spec.max_wheel_rate)


class Odometer:
    """Encoders that count whole steps, integrated with the radii and the track of the specification."""

    def __init__(self, spec: DriveSpec) -> None:
        self._spec = spec
        self._readings = 0
        self._angles = AT_REST
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
