"""Places where the robot may be, followed side by side until what is seen on the way leaves one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.localization.error_table import ErrorTable
from slam.localization.matching_optimisation import MatchingOptimisation
from slam.localization.multi_start import Place, same
from slam.motion.motion_noise import MotionNoise
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray

APART = (0.3, 0.2)
"""Nearer than this two places are one [m], [rad]."""
PRICE = 20.0
"""What a scan that is wholly wrong costs: so many nats of evidence, for its beams are not independent."""
BEHIND = 5.0
"""A place is given up that costs so much more than the best one: it is 150 times less likely."""
NEXT = (0.2, 0.3)
"""Way [m] or turn [rad] after which a scan shows something new."""
FITS = 0.5
"""Share of the scan that the last place must explain."""
PATIENCE = 30
"""Scans that the last place may explain badly before all is given up."""


@dataclass(slots=True, eq=False)
class Hypothesis:
    """One place and what speaks against it."""

    T_map_base: SE2
    covariance: FloatArray
    cost: float
    explained: float


class Hypotheses:
    """Empty until `begin` is given places; `decided` once one of them is left that fits."""

    def __init__(self, matching: MatchingOptimisation, table: ErrorTable) -> None:
        self._matching, self._table = matching, table
        self._all: list[Hypothesis] = []
        self._way = SE2()
        self._bad = 0

    def __len__(self) -> int:
        return len(self._all)

    @property
    def best(self) -> Hypothesis | None:
        """The place that least speaks against; None where there is none."""
        return self._all[0] if self._all else None

    @property
    def decided(self) -> bool:
        """Whether one place is left, and fits."""
        return len(self._all) == 1 and self._all[0].explained >= FITS

    def begin(self, places: list[Place]) -> None:
        """Take up the places that explain a scan not much worse than the best one; none where none explains half of it."""
        spread = np.diag([0.1**2, 0.1**2, 0.1**2])
        self._all = [
            Hypothesis(place.T_map_base, spread, PRICE * place.wrong, 1.0 - place.wrong) for place in places if place.wrong <= 1.0 - FITS
        ]
        self._way, self._bad = SE2(), 0
        self._leave_the_likely()

    def follow(self, cloud: PointScan, step: SE2, noise: MotionNoise) -> None:
        """Move all places on and match a scan from each."""
        self._way = self._way @ step
        new = math.hypot(self._way.x, self._way.y) > NEXT[0] or abs(self._way.yaw) > NEXT[1]
        for one in self._all:
            guess, prior = one.T_map_base @ step, noise.propagate(one.covariance, one.T_map_base, step)
            prior += np.diag([noise.distance_floor**2, noise.distance_floor**2, noise.yaw_floor**2])
            found = self._matching.match(self._table, cloud.points, guess.as_array()[None], guess, (prior, prior))
            one.T_map_base, one.covariance, one.explained = found.T_map_base, np.array(found.covariance), found.explained
            one.cost += PRICE * (1.0 - found.explained) * new
        if new:
            self._way = SE2()
        self._leave_the_likely()

    def covariance(self) -> FloatArray:
        """(3, 3) of all places about the best one [m, rad]."""
        best = self._all[0]
        total, weights = np.zeros((3, 3)), self._weights()
        for one, weight in zip(self._all, weights, strict=True):
            off = one.T_map_base.as_array() - best.T_map_base.as_array()
            off[2] = (best.T_map_base.inverse() @ one.T_map_base).yaw
            total += weight * (one.covariance + np.outer(off, off))
        return total

    def as_rows(self) -> FloatArray:
        """(N, 4) of x, y [m], yaw [rad], weight."""
        poses = np.array([one.T_map_base.as_array() for one in self._all]).reshape(-1, 3)
        return np.column_stack([poses, self._weights()])

    def _weights(self) -> FloatArray:
        costs = np.array([one.cost for one in self._all])
        weights = np.exp(costs.min(initial=np.inf) - costs) if len(costs) else costs
        return weights / max(float(weights.sum()), 1e-12)

    def _leave_the_likely(self) -> None:
        """Drop what is far behind, and doubles; all, when the last one has fitted badly for long."""
        left: list[Hypothesis] = []
        for one in sorted(self._all, key=lambda one: one.cost):
            likely = one.cost <= (left[0].cost if left else one.cost) + BEHIND
            if likely and not any(same(one.T_map_base, other.T_map_base, APART) for other in left):
                left.append(one)
        self._bad = self._bad + 1 if left and left[0].explained < FITS else 0
        self._all = [] if self._bad > PATIENCE else left
