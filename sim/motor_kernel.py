"""One tick of the EV3's motors: encoder edges, the firmware's speed regulator, and the DC motor with its gears."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TICK = 0.002
"""Period of the firmware's motor task [s]: one physics step."""
TIMER = 132e6 / 4 / 256
"""Rate of the clock that times encoder edges [1/s]."""
PERCENT_TICKS = 12800
"""Timer ticks from edge to edge of a large motor at 1 % of full speed."""
EDGE = math.tau / 360
"""Angle from encoder edge to encoder edge [rad]."""
PERCENT_RATE = EDGE * TIMER / PERCENT_TICKS
"""1 % of full speed [rad/s]: 10.07 deg/s."""
FULL_DUTY = 10000
"""Duty of 100 %, as the regulator counts."""
BUFFER = 65
"""Edge times that are kept: the average is over 64 intervals at most."""

ANGLE, RATE = 0, 1
"""Columns of floats: a motor's angle [rad] and rate [rad/s], at its output."""
STRENGTH = 1.0
"""More than what a motor and its gears can pass on to a wheel [N m]."""
DUTY, INTEGRAL, ERROR, SPEED, COUNT, EDGES, NEWEST, DIRECTION = range(8)
"""Columns of ints: regulator, measured percent, encoder count, edges in the buffer, place of the newest, sign of the last edge."""
STATES = 8 + BUFFER
CHARGE, VOLTS = 2, 3
"""Places in what the brick keeps, after the rates that its program asks of the regulators [rad/s]: share of the charge, volts."""
States = tuple[Floats, Ints, Floats]
"""Floats (2, 2) and ints (2, STATES) of both motors, and what the brick keeps (4,)."""


@njit
def sense(ints: Ints, angle: float, now: int) -> None:
    """Count the edges up to the motor's `angle` [rad] at timer tick `now`, and measure the speed in whole percent.

    The time between edges is averaged over the last 4, 16, 32 or 64 at up to 40, 60, 80 %, and above.
    """
    count = int(np.floor(angle / EDGE + 0.5))
    steps = abs(count - ints[COUNT])
    if steps == 0:
        if now - ints[STATES - BUFFER + ints[NEWEST]] > PERCENT_TICKS:
            ints[SPEED] = ints[EDGES] = 0
        return
    direction = 1 if count > ints[COUNT] else -1
    if direction != ints[DIRECTION]:
        ints[SPEED] = ints[EDGES] = 0
    ints[DIRECTION], ints[COUNT] = direction, count
    span = int(TICK * TIMER)
    for k in range(steps):
        ints[NEWEST] = (ints[NEWEST] + 1) % BUFFER
        ints[STATES - BUFFER + ints[NEWEST]] = now - span * (steps - 1 - k) // steps
        ints[EDGES] = min(ints[EDGES] + 1, BUFFER)
    if ints[EDGES] > 1:
        ints[SPEED] = direction * _percent(ints)


@njit
def regulate(ints: Ints, target: int) -> None:
    """Change the duty towards `target` percent: lms2012, d_pwm.c, dRegulateSpeed of a large motor. 0 % brakes."""
    if target == 0:
        ints[DUTY] = ints[INTEGRAL] = ints[ERROR] = 0
        return
    error = target - ints[SPEED]
    ints[INTEGRAL] = _quotient(9 * ints[INTEGRAL], 10) + _quotient(error, 4)
    duty = ints[DUTY] + 2 * error + ints[INTEGRAL] + 80 * (error - ints[ERROR])
    ints[ERROR] = error
    low, high = (0, FULL_DUTY) if target > 0 else (-FULL_DUTY, 0)
    ints[DUTY] = min(max(duty, low), high)


@njit
def turn(floats: Floats, duty: float, load: float, motor: tuple[float, ...]) -> float:
    """Let a motor turn for one tick against the `load` of its wheel [N m]; returns its current [A].

    Args:
        floats: angle and rate, changed in place.
        duty: of the battery's voltage, -1..1; the rest of the time the winding is shorted.
        load: of the last tick.
        motor: battery [V], resistance [Ohm], back EMF [V s/rad], torque constant [N m/A], friction [N m], inertia [kg m^2].
    """
    volts, resistance, emf, constant, friction, inertia = motor
    # implicit in the back EMF, so that a light rotor stays stable
    rate = floats[RATE] + TICK / inertia * (constant * duty * volts / resistance - load)
    rate /= 1.0 + TICK / inertia * constant * emf / resistance
    rate -= np.sign(rate) * min(TICK / inertia * friction, abs(rate))
    floats[RATE] = rate
    floats[ANGLE] += TICK * rate
    return (duty * volts - emf * rate) / resistance


@njit
def carry(motor: Floats, wheel: float, rate: float, gears: tuple[float, float]) -> tuple[float, float]:
    """The rate to which a motor brings its wheel in one tick [rad/s], and the torque for that [N m] at most.

    Within the backlash only friction brakes the wheel. The teeth are not corrected by force: at rest that would strain the contacts
    with the floor, and PyBullet's creep.

    Args:
        motor: angle and rate.
        wheel: angle of the wheel [rad].
        rate: of the wheel [rad/s].
        gears: backlash [rad], that friction [N m].
    """
    backlash, friction = gears
    lead = motor[ANGLE] - (wheel + TICK * rate)
    return (0.0, friction) if abs(lead) < 0.5 * backlash else (motor[RATE], STRENGTH)


@njit
def tick(
    states: States, goals: tuple[float, float], wheels: tuple[float, ...], motor: tuple[float, ...], battery: tuple[float, ...], now: int
) -> tuple[float, ...]:
    """What makes the wheels turn in the next tick: rates [rad/s], torques at most [N m]; angles of the encoders [rad]; volts.

    Args:
        states: changed in place.
        goals: wheel rates that the brick's program asks for [rad/s].
        wheels: angles [rad], rates [rad/s] and loads [N m], of the left and the right wheel each.
        motor: resistance to inertia as in `turn`; backlash and friction of `carry`; how fast the goals are approached [rad/s^2].
        battery: volts when empty and full, capacity [C], resistance [Ohm], current of the brick [A].
        now: tick of the timer.
    """
    floats, ints, brick = states
    empty, full, capacity, resistance, drawn = battery
    gears, ramp = (motor[5], motor[6]), motor[7] * TICK
    rates, torques = np.empty(2), np.empty(2)
    for k in range(2):
        floats[k, ANGLE] = min(max(floats[k, ANGLE], wheels[k] - 0.5 * gears[0]), wheels[k] + 0.5 * gears[0])
        sense(ints[k], floats[k, ANGLE], now)
        brick[k] += min(max(goals[k] - brick[k], -ramp), ramp)
        regulate(ints[k], int(np.rint(brick[k] / PERCENT_RATE)))
        duty = ints[k, DUTY] / FULL_DUTY
        drawn += duty * turn(floats[k], duty, wheels[4 + k], (brick[VOLTS], motor[0], motor[1], motor[2], motor[3], motor[4]))
        rates[k], torques[k] = carry(floats[k], wheels[k], wheels[2 + k], gears)
    brick[CHARGE] -= TICK * drawn / capacity
    brick[VOLTS] = empty + max(brick[CHARGE], 0.0) * (full - empty) - resistance * drawn
    return rates[0], rates[1], torques[0], torques[1], floats[0, ANGLE], floats[1, ANGLE], brick[VOLTS]


@njit
def _percent(ints: Ints) -> int:
    """Speed in whole percent, 100 at most, averaged over as many edges as the speed of the last one asks for."""
    newest = ints[STATES - BUFFER + ints[NEWEST]]
    single = PERCENT_TICKS // max(newest - ints[STATES - BUFFER + (ints[NEWEST] - 1) % BUFFER], 1)
    samples = 4 if single <= 40 else 16 if single <= 60 else 32 if single <= 80 else 64
    samples = min(samples, ints[EDGES] - 1)
    return int(min(PERCENT_TICKS * samples // max(newest - ints[STATES - BUFFER + (ints[NEWEST] - samples) % BUFFER], 1), 100))


@njit
def _quotient(a: int, b: int) -> int:
    """Integer quotient as C has it: towards zero."""
    return a // b if a >= 0 else -(-a // b)
