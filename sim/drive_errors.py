"""How far the drive is from a perfect one: every number of it. The sources are in docs/realism.md."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class DriveErrors:
    """Errors and physics of the drive; the defaults are a perfect one, whose wheels follow the command with a short lag."""

    radius_left: float = 0.0
    """True over specified radius of the left wheel, minus 1."""
    radius_right: float = 0.0
    """True over specified radius of the right wheel, minus 1."""
    track: float = 0.0
    """True over specified track, minus 1."""
    wheel_friction: float = 0.9
    """Of the tyres on the floor; with less they slip more."""
    caster_friction: float = 0.05
    """Of the caster on the floor: its drag."""
    regulator: float = 0.0
    """1: DC motors under the firmware's speed regulator in whole percent; 0: rates followed with a short lag, and the rest is unused."""
    ramp: float = 20.0
    """How fast the brick's program changes what it asks of a regulator [rad/s^2]; twice as fast would lift the caster."""
    resistance: float = 5.0
    """Of a motor's winding [Ohm]: 9 V over 1.8 A at stall."""
    back_emf: float = 0.475
    """Voltage over rate of a motor's output [V s/rad]: (9 V - 5 Ohm x 0.06 A) over 18.33 rad/s without load."""
    torque_constant: float = 0.24
    """Torque over current of a motor's output [N m/A]: 0.43 N m over 1.8 A at stall; what the back EMF has more is lost in the gears."""
    friction: float = 0.0144
    """Of a motor and its gears, at its output [N m]: torque of the 0.06 A without load."""
    rotor_inertia: float = 0.0012
    """Of a motor and its gears, at its output [kg m^2]: gives the motor alone a time constant of 53 ms."""
    backlash: float = 0.0
    """Angle by which a motor turns before its wheel follows in the other direction [rad]."""
    axle_friction: float = 0.003
    """That brakes a wheel while the backlash is crossed [N m]."""
    battery: float = 8.1
    """Voltage of the full battery without load [V]."""
    battery_empty: float = 7.1
    """Voltage of the empty battery without load [V]."""
    battery_capacity: float = 7380.0
    """Charge of the full battery [C]: 2050 mAh."""
    battery_charge: float = 0.7
    """Share of the charge at the start."""
    battery_resistance: float = 0.0
    """Inside the battery [Ohm]: it sags under load."""
    brick_current: float = 0.18
    """Drawn by the brick itself [A]."""


DATASHEET = DriveErrors(
    radius_left=0.005,
    radius_right=-0.003,
    track=0.01,
    caster_friction=0.15,
    regulator=1.0,
    backlash=math.radians(2.0),
    battery_resistance=0.25,
)

HARSH = replace(
    DATASHEET,
    radius_left=0.010,
    radius_right=-0.006,
    track=0.02,
    wheel_friction=0.5,
    caster_friction=0.3,
    backlash=math.radians(4.0),
    battery_charge=0.3,
    battery_resistance=0.5,
)
