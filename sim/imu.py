"""The EV3's yaw gyro."""

from __future__ import annotations

import numpy as np

from hardware.spec import ImuSpec
from sim.motion import NANOSECONDS, Motion
from sim.realism import Realism
from slam.messages import Imu


class Gyro:
    """True yaw rate + bias + white noise, clipped to the gyro's range."""

    def __init__(self, spec: ImuSpec, realism: Realism, rng: np.random.Generator) -> None:
        self._spec = spec
        self._sigma = realism.gyro_sigma
        self._rng = rng
        self._bias = realism.gyro_bias_sigma * rng.standard_normal()
        self._readings = 0

    @property
    def due(self) -> float:
        """Time of the next reading [s]."""
        return round(self._readings * self._spec.period, NANOSECONDS)

    def read(self, motion: Motion) -> Imu:
        """The reading that is due."""
        stamp = self.due
        rate = motion.yaw_rate_at(stamp) + self._bias + self._sigma * self._rng.standard_normal()
        self._readings += 1
        return Imu(stamp, min(max(rate, -self._spec.max_rate), self._spec.max_rate))
