"""The places where the robot may be: particles that hang together."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slam.kernels import bins as kernels
from slam.kernels.moments import moments
from slam.localization.particles import YAW_BINS, Particles
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Cluster:
    """One mode of a belief."""

    T_map_base: SE2
    """Its mean."""
    covariance: FloatArray
    """(3, 3) of (x, y, yaw) in the map frame [m, rad]."""
    weight: float
    """Its share of all weight."""

    def __str__(self) -> str:
        T = self.T_map_base
        return f"({T.x:.2f}, {T.y:.2f}, {math.degrees(T.yaw):.0f} deg) {100.0 * self.weight:.0f} %"


def clusters_of(particles: Particles, least: float = 0.01) -> tuple[Cluster, ...]:
    """All modes with a share of the weight of `least` or more, the heaviest first; always one at least.

    Particles hang together whose bins touch, as in the clustering of ROS's amcl: two modes are never nearer than a bin.
    """
    bins, places = particles.bins
    labels = kernels.connect(places, YAW_BINS)
    shares, means, covariances = moments(particles.poses, particles.weights, labels[bins], len(places))
    weights = shares.tolist()
    order = sorted(range(len(weights)), key=lambda k: -weights[k])
    found = [k for k in order if weights[k] >= least] or order[:1]
    return tuple(Cluster(SE2(*means[k].tolist()), covariances[k], weights[k]) for k in found)
