"""How far the gyro is from a perfect one: every number of it. The sources are in docs/realism.md."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class GyroErrors:
    """Errors of the yaw gyro; the defaults are none."""

    bias_sigma: float = 0.0
    """Standard deviation of the bias, drawn at every reset [rad/s]."""
    drift_sigma: float = 0.0
    """Standard deviation of how far the bias walks in one second [rad/s]; it grows with the root of time."""
    scale_sigma: float = 0.0
    """Standard deviation of the scale error, drawn at every reset, as a share of the rate."""
    noise_sigma: float = 0.0
    """Standard deviation of one reading before it is rounded [rad/s]."""
    step: float = 0.0
    """Readings are whole multiples of this [rad/s]; 0: any."""


DATASHEET = GyroErrors(
    bias_sigma=math.radians(0.1),  # what the calibration at rest leaves
    drift_sigma=math.radians(0.005),
    scale_sigma=0.01,  # LEGO: +-3 deg in 90 deg, read as three sigma
    noise_sigma=math.radians(0.4),
    step=math.radians(1.0),
)

HARSH = GyroErrors(math.radians(0.2), math.radians(0.01), 0.02, math.radians(0.8), math.radians(1.0))
