"""Where people have lately been seen, in the odometry's frame, and how likely a beam of the lidar meets one of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.errors import require_positive
from slam.landmarks.people import PersonSighting
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True)
class Carrying:
    """How long sightings hold, and how they widen."""

    memory: float = 0.6
    """A sighting counts for so long [s]: pictures come seldom, and the detector misses one in ten people."""
    walking: float = 1.0
    """Speed by which a span widens with its age [m/s]."""
    margin: float = math.radians(1.5)
    """Added to half the span that the depth image shows [rad]."""

    def __post_init__(self) -> None:
        require_positive(self, "memory", "walking", "margin")


class PeopleAround:
    """Sightings of the last moments."""

    def __init__(self, settings: Carrying) -> None:
        self._settings = settings
        self._spans: list[tuple[float, float, FloatArray]] = []  # stamp, score, left and right edge (2, 2) in odom

    def see(self, sightings: tuple[PersonSighting, ...], T_odom_base: SE2) -> None:
        """Take in what a picture shows; the pose is that of its moment."""
        for sighting in sightings:
            edges = T_odom_base.transform(np.array([sighting.left, sighting.right]))
            self._spans.append((sighting.stamp, sighting.score, edges))

    def probabilities(self, origins: FloatArray, ends: FloatArray, T_odom_base: SE2, now: float) -> FloatArray:
        """Probabilities q (M,) that somebody whom the camera saw is in a beam's direction.

        A Gaussian over bearing for each of them, cut at two deviations; noisy-or in place of the document's weighted sum.

        Args:
            origins: (M, 2) of the beams in base [m].
            ends: (M, 2) in base [m].
            T_odom_base: at the scan.
            now: stamp of the scan [s].
        """
        self._spans = [span for span in self._spans if now - span[0] <= self._settings.memory]
        free = np.ones(len(ends))
        if not self._spans or len(ends) == 0:
            return 1.0 - free
        beams = ends - origins
        T_base_odom, eye = T_odom_base.inverse(), origins.mean(axis=0)
        for stamp, score, edges in self._spans:
            left, right = T_base_odom.transform(edges) - eye
            middle = 0.5 * (left + right)
            distance = max(float(np.hypot(middle[0], middle[1])), 0.1)
            half = 0.5 * math.atan2(float(np.hypot(*(left - right))), distance)
            sigma = half + self._settings.margin + self._settings.walking * max(now - stamp, 0.0) / distance
            off = np.arctan2(middle[0] * beams[:, 1] - middle[1] * beams[:, 0], beams @ middle)
            free *= 1.0 - np.where(abs(off) <= 2.0 * sigma, score * np.exp(-0.5 * (off / sigma) ** 2), 0.0)
        return 1.0 - free
