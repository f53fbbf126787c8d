"""The LEGO robot's parts: sizes and masses as LEGO, Hokuyo and Intel make them, places in `base`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slam.se2 import FloatArray

Vector = tuple[float, float, float]

CASTER_RADIUS = 0.011
CASTER_MASS = 0.010
CASTER_CENTRE: Vector = (-0.093, 0.0, CASTER_RADIUS)
WHEEL_WIDTH = 0.028
WHEEL_MASS = 0.035
HULL_CENTRE: Vector = (-0.011, 0.0, 0.115)
HULL_SIZE: Vector = (0.188, 0.148, 0.19)
"""The box that bumps into things: everything, wheels included."""


@dataclass(frozen=True, slots=True)
class Part:
    """A box of even density whose sides lie along the axes of its frame."""

    name: str
    size: Vector
    """Along x, y, z [m]."""
    mass: float
    """[kg]"""
    colour: Vector
    """Red, green, blue, 0..1."""
    centre: Vector = (0.0, 0.0, 0.0)
    """[m]"""

    def inertia(self) -> FloatArray:
        """Inertia tensor (3, 3) about the part's own centre [kg m^2]."""
        x, y, z = np.square(self.size)
        return np.diag([y + z, z + x, x + y]) * self.mass / 12.0


LIGHT_GREY, DARK_GREY, WHITE, BLACK, RED = (0.64, 0.64, 0.66), (0.33, 0.34, 0.36), (0.93, 0.93, 0.93), (0.08, 0.08, 0.08), (0.77, 0.1, 0.1)

BODY = (
    Part("brick", (0.111, 0.072, 0.049), 0.287, LIGHT_GREY, (-0.045, 0.0, 0.0785)),
    Part("motor_left", (0.110, 0.045, 0.045), 0.082, WHITE, (-0.025, 0.0235, 0.031)),
    Part("motor_right", (0.110, 0.045, 0.045), 0.082, WHITE, (-0.025, -0.0235, 0.031)),
    Part("deck", (0.110, 0.072, 0.019), 0.045, DARK_GREY, (0.0, 0.0, 0.1125)),
    Part("mast", (0.008, 0.016, 0.093), 0.010, RED, (-0.006, 0.0, 0.1685)),
    Part("arm", (0.064, 0.016, 0.008), 0.007, RED, (0.030, 0.0, 0.211)),
    Part("caster_holder", (0.024, 0.032, 0.034), 0.012, DARK_GREY, (-0.093, 0.0, 0.036)),
)
"""What is bolted together; the mast stands in the lidar's blind sector and carries the camera over the scan plane."""

LIDAR = Part("lidar", (0.050, 0.050, 0.070), 0.160, BLACK, (0.0, 0.0, -0.023))
"""In `laser`: the scan plane lies 58 mm above the foot."""
CAMERA = Part("camera", (0.025, 0.090, 0.025), 0.072, LIGHT_GREY, (-0.0085, 0.0, 0.0))
"""In axes x forward, y left, z up at the lens, 4 mm behind the glass."""
GYRO = Part("gyro", (0.040, 0.024, 0.024), 0.010, WHITE)
"""In `imu`."""


def combined(parts: tuple[Part, ...]) -> tuple[float, FloatArray, FloatArray]:
    """Mass [kg], centre of mass (3,) [m] and inertia tensor about it (3, 3) [kg m^2] of parts in one frame."""
    masses = np.array([part.mass for part in parts])
    centres = np.array([part.centre for part in parts])
    total = float(masses.sum())
    centre = masses @ centres / total
    inertia = np.zeros((3, 3))
    for part, offset in zip(parts, centres - centre, strict=True):
        inertia += part.inertia() + part.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))  # parallel axes
    return total, centre, inertia
