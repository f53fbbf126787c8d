"""The EV3's yaw gyro in its rate mode."""

from __future__ import annotations

import math

import numpy as np

from hardware.spec import ImuSpec
from sim.motion import NANOSECONDS, Motion
from sim.realism import Realism
from slam.messages import Imu


class Gyro:
    """True yaw rate with a scale error, + a bias that walks + white noise, in whole steps, clipped to the gyro's range.

    Rate mode, because angle mode gives whole degrees, of which no rate can be made at 100 readings a second, and because some
    units hang in the mode that gives both.
    """

    def __init__(self, spec: ImuSpec, realism: Realism, rng: np.random.Generator) -> None:
        self._spec = spec
        self._errors = realism.gyro
        self._rng = rng
        self._bias = self._errors.bias_sigma * rng.standard_normal()
        self._scale = 1.0 + self._errors.scale_sigma * rng.standard_normal()
        self._readings = 0

    @property
    def due(self) -> float:
        """Time of the next reading [s]."""
        return round(self._readings * self._spec.period, NANOSECONDS)

    def read(self, motion: Motion) -> Imu:
        """The reading that is due."""
        stamp, errors = self.due, self._errors
        noise, walk = self._rng.standard_normal(2)
        self._bias += errors.drift_sigma * math.sqrt(self._spec.period) * walk
        rate = self._scale * motion.yaw_rate_at(stamp) + self._bias + errors.noise_sigma * noise
        if errors.step > 0.0:
            rate = round(rate / errors.step) * errors.step
        self._readings += 1
        return Imu(stamp, float(min(max(rate, -self._spec.max_rate), self._spec.max_rate)))
