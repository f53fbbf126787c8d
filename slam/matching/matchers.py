"""Matchers by name, behind one face: two scans and a guess in, a `Match` out. Their own faces keep what a target needs prepared."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

import numpy as np

from slam.errors import UnknownNameError
from slam.matching.branch_and_bound import BranchAndBound, Found
from slam.matching.gauss_newton import GaussNewton
from slam.matching.icp import Icp
from slam.matching.localizability import scan_information
from slam.matching.match import Match, finite, no_prior
from slam.matching.ndt import Ndt
from slam.matching.plicp import PlIcp
from slam.matching.score_pyramid import ScorePyramid
from slam.se2 import SE2, FloatArray, wrap_angle


class ScanMatcher(Protocol):
    """A frozen dataclass of parameters that lays one scan over another."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def register(self, source: FloatArray, target: FloatArray, guess: SE2, prior: FloatArray | None = None) -> Match:
        """Pose of the source in the target.

        Args:
            source: (M, 2) points of the scan in its own frame, seen from near its origin, in any order [m]. Points that are not finite
                are left out of both.
            target: (N, 2) points of the other scan [m].
            guess: T_target_source to start from.
            prior: (3, 3) covariance of the guess (x, y, yaw) in the target frame [m, rad]; it decides where the scans do not. By default
                it hardly pulls.

        Returns:
            The match; not converged where the scans decide nothing. It never raises on what the points say.
        """
        ...


@dataclass(frozen=True, slots=True)
class Correlative:
    """The best pose of a window by branch and bound, weighed against the prior: the only one that needs no good guess."""

    search: BranchAndBound = field(default_factory=BranchAndBound)

    def register(self, source: FloatArray, target: FloatArray, guess: SE2, prior: FloatArray | None = None) -> Match:
        """See `ScanMatcher`. `inliers` is the score; converged means that no other place in the window scores as well."""
        source, target = finite(source), finite(target)
        prior = no_prior() if prior is None else prior
        if not scan_information(source, guess).any():  # a scan without a line fits in too many places to try
            return Match(guess, prior, False, 0.0, 0.0, 0, source)
        found = self.search.search(ScorePyramid.of_scan(target, np.zeros_like(target)), source, guess)
        if found is None:
            return Match(guess, prior, False, 0.0, 0.0, 0, source)
        pose, covariance = _weighed(found, guess, prior)
        share = min(max(found.score, 0.0), 1.0)
        return Match(pose, covariance, found.ambiguity < 1.0, 0.0, share, 1, source)


def _weighed(found: Found, guess: SE2, prior: FloatArray) -> tuple[SE2, FloatArray]:
    """Mean and covariance of what was found and of the guess."""
    T = found.T_map_base
    away = np.array([T.x - guess.x, T.y - guess.y, wrap_angle(T.yaw - guess.yaw)])
    K = prior @ np.linalg.inv(prior + found.covariance)
    covariance = (np.eye(3) - K) @ prior
    return SE2.from_array(guess.as_array() + K @ away), 0.5 * (covariance + covariance.T)


MATCHERS: dict[str, type[ScanMatcher]] = {
    "icp": Icp,
    "plicp": PlIcp,
    "gauss_newton": GaussNewton,
    "correlative": Correlative,
    "ndt": Ndt,
}
"""name -> frozen dataclass of parameters."""


def matcher_settings(name: str) -> type[ScanMatcher]:
    """The matcher's parameter class.

    Raises:
        UnknownNameError: no such matcher; the message lists those there are.
    """
    if name not in MATCHERS:
        raise UnknownNameError("matcher", name, sorted(MATCHERS))
    return MATCHERS[name]
