"""Which beams of a scan judge a pose, and how much each of them counts."""

from __future__ import annotations

import math

import numpy as np

from slam.kernels.bins import fill
from slam.scans import PointScan
from slam.se2 import FloatArray

TOUCHING = 0.15
"""So near to the laser are the robot's own outline and what touches it [m]."""


def evenly(cloud: PointScan, beams: int) -> PointScan:
    """At most so many beams, evenly spread over those that are valid; all of them for 0."""
    if beams <= 0 or beams >= len(cloud.points):
        return cloud
    chosen = (2 * np.arange(beams) + 1) * len(cloud.points) // (2 * beams)
    return PointScan(cloud.stamp, cloud.points.take(chosen, axis=0), cloud.origins.take(chosen, axis=0))


def apart(cloud: PointScan) -> PointScan:
    """The beams that end farther from the laser than what touches the robot, which is in no map: somebody who stands around it."""
    away = cloud.points - cloud.origins
    far = np.square(away).sum(axis=1) > TOUCHING**2
    return cloud if far.all() else PointScan(cloud.stamp, cloud.points[far], cloud.origins[far])


def one_opinion_each(points: FloatArray, patch: float) -> FloatArray:
    """How much each of the points (M, 2) counts, (M,): all those in one square of side `patch` [m] together as one; 1 each for 0.

    Beams are not independent: those that end on the same piece of wall share what the map has wrong there, so that more of them
    do not know it better. A wall near by, or a person, is no more to be believed for being seen by many beams.
    """
    if patch <= 0.0 or len(points) == 0:
        return np.ones(len(points))
    places = np.zeros((len(points), 3))
    places[:, :2] = points
    which, squares = fill(places, (patch, math.tau))
    return 1.0 / np.bincount(which, minlength=len(squares))[which]
