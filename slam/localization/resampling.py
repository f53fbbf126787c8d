"""Drawing anew: who survives, and how many are needed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from slam.errors import ParameterError, require_positive
from slam.kernels import bins as kernels
from slam.kernels.resampling import systematic
from slam.localization.particles import Particles
from slam.se2 import FloatArray


def parents(weights: FloatArray, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Indices (count,) of those that survive, ascending: systematic resampling, one random number and one pass."""
    return systematic(weights, rng.random(), count)


@dataclass(frozen=True, slots=True)
class Kld:
    """How many particles it takes: Fox, "Adapting the sample size in particle filters through KLD-sampling" (2003), equation 14."""

    particles_min: int = 500
    particles_max: int = 5000
    error: float = 0.05
    """Largest Kullback-Leibler distance between the particles and what they stand for."""
    quantile: float = 2.33
    """Of the standard normal distribution at the probability that the error is not exceeded: 2.33 is 99 %."""

    def __post_init__(self) -> None:
        require_positive(self, "particles_min", "error", "quantile")
        if self.particles_max < self.particles_min:
            raise ParameterError(self, "particles_max", f"at least particles_min, {self.particles_min}")

    def needed(self, bins: int) -> int:
        """Particles for a belief that fills so many bins."""
        if bins <= 1:
            return self.particles_min
        a = 2.0 / (9.0 * (bins - 1))
        count = (bins - 1) / (2.0 * self.error) * (1.0 - a + math.sqrt(a) * self.quantile) ** 3
        return min(max(math.ceil(count), self.particles_min), self.particles_max)

    def draw(self, particles: Particles, rng: np.random.Generator) -> NDArray[np.int64]:
        """Indices of those that survive: as many as the bins call for in which they lie.

        The bins are counted over a systematic draw of as many as there are, not one by one as in Fox's algorithm: a systematic
        draw is in the particles' order, and its first part is not yet a sample of the whole.
        """
        offset = rng.random()
        if self.particles_min == self.particles_max:
            return systematic(particles.weights, offset, self.particles_max)
        drawn = systematic(particles.weights, offset, len(particles))
        bins, places = particles.bins
        count = self.needed(kernels.count_of(bins, len(places), drawn))
        return drawn if count == len(particles) else systematic(particles.weights, offset, count)


def quantile_of(probability: float) -> float:
    """The quantile of the standard normal distribution."""
    return NormalDist().inv_cdf(probability)
