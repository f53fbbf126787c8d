"""What is plugged into the EV3's inputs: types, modes, values, and the time that a change of mode takes."""

from __future__ import annotations

import math
from typing import Protocol

from hardware.emulators.ev3_motors import Motor
from hardware.protocols import ev3_direct

MODE_CHANGE = {ev3_direct.GYRO: 0.5}
"""Time that a sensor takes to change its mode [s]."""
QUICK_CHANGE = 0.1
"""The other sensors [s]."""
KEEP_TYPE, KEEP_MODE = 0, -1


class Sensing(Protocol):
    """What the sensors feel."""

    def now(self) -> float:
        """Time [s]."""
        ...

    def motors(self) -> tuple[int, ...]:
        """Outputs with a large motor (A is 0)."""
        ...

    def sensors(self) -> dict[int, int]:
        """Input 0..3 -> type."""
        ...

    def sense(self, number: int, mode: int) -> tuple[float, ...]:
        """Values of an input in a mode, in the sensor's own units."""
        ...


class Inputs:
    """Inputs 0..3, and the motors as inputs 16..19."""

    def __init__(self, body: Sensing, motors: list[Motor]) -> None:
        self._body = body
        self._motors = motors
        self._modes: dict[int, int] = {}
        self._changed: dict[int, float] = {}

    def identity(self, number: int) -> tuple[int, int]:
        """Type and mode of an input."""
        if 0 <= number - ev3_direct.MOTOR_INPUTS < len(self._motors):
            kind = ev3_direct.LARGE_MOTOR if number - ev3_direct.MOTOR_INPUTS in self._body.motors() else ev3_direct.NO_SENSOR
        else:
            kind = self._body.sensors().get(number, ev3_direct.NO_SENSOR)
        return kind, self._modes.get(number, 0)

    def choose(self, number: int, kind: int, mode: int) -> bool:
        """Ask for a mode; whether the input gives values in it now."""
        plugged, current = self.identity(number)
        if plugged == ev3_direct.NO_SENSOR or kind not in (KEEP_TYPE, plugged):
            return True  # READY does not wait for what is not there
        if mode not in (KEEP_MODE, current):
            self._modes[number] = mode
            self._changed[number] = self._body.now() + MODE_CHANGE.get(plugged, QUICK_CHANGE)
        return self._body.now() >= self._changed.get(number, -math.inf)

    def values(self, number: int, kind: int, count: int) -> tuple[float, ...]:
        """Values in the chosen mode; nan is no data."""
        plugged, mode = self.identity(number)
        ready = self._body.now() >= self._changed.get(number, -math.inf)
        if plugged == ev3_direct.NO_SENSOR or kind not in (KEEP_TYPE, plugged) or not ready:
            return (math.nan,) * count
        known = self._of_motor(number, mode) if number >= ev3_direct.MOTOR_INPUTS else self._body.sense(number, mode)
        return (*known, *(math.nan,) * count)[:count]

    def _of_motor(self, number: int, mode: int) -> tuple[float, ...]:
        motor = self._motors[number - ev3_direct.MOTOR_INPUTS]
        return (float(motor.speed if mode == 2 else motor.count),)  # raw values of mode 1 are degrees too
