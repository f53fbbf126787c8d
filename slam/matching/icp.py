"""Point-to-point ICP of two scans: Besl, McKay, "A method for registration of 3-D shapes" (1992), in the plane."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from slam.errors import ParameterError, require_positive
from slam.kernels.sandwich import STEP, Residuals, blocks_of, settle, usable
from slam.matching.localizability import scan_information
from slam.matching.match import Match, no_prior
from slam.se2 import SE2, FloatArray, wrap_angle

FEWEST_PAIRS = 3
"""Two pairs fix a rigid motion, the third says how well."""
SMALLEST_SPREAD = 1e-12
"""Sum of squared distances of the paired points to their mean below which they have no direction [m^2]."""
COMMON = 0.2
"""Share of the residual that half a metre of wall has in common beyond what is seen of it."""
ORBIT_SHARE = 0.1
"""A scan that is paired anew at every step often ends going round between a few poses instead of at rest, on the public URG-04LX
recording one in six. Up to this share of the rms the poses are one, and the match has converged."""


@dataclass(frozen=True, slots=True, eq=False)
class IcpStep:
    """One pose on the way to the answer, and the correspondences found there."""

    T_target_source: SE2
    p: FloatArray
    """(k, 2) paired source points at this pose, in the target frame [m]."""
    q: FloatArray
    """(k, 2) their counterparts in the target [m]."""
    change: float
    """How far from the nearest pose before it, the largest of x, y [m], cos yaw, sin yaw; infinite for the guess."""

    @property
    def rms(self) -> float:
        """Root mean square distance of the pairs [m]; 0 without any."""
        return math.sqrt(float(np.sum((self.p - self.q) ** 2)) / max(len(self.p), 1))

    @property
    def spread(self) -> float:
        """Sum of squared distances of the paired source points to their mean [m^2]."""
        return float(np.sum((self.p - self.p.mean(axis=0)) ** 2)) if len(self.p) else 0.0

    @property
    def determined(self) -> bool:
        """The pairs are enough, and far enough apart, to fix a pose."""
        return len(self.p) >= FEWEST_PAIRS and self.spread > SMALLEST_SPREAD


@dataclass(frozen=True, slots=True)
class Icp:
    """Nearest neighbours, filtered to one-to-one and trimmed, aligned in closed form, until nothing moves."""

    iterations: int = 100
    """Most steps."""
    tolerance: float = 1e-6
    """Ends at a pose nearer than this to one before it [m or rad]."""
    trim: float = 0.9
    """Share of the correspondences that is kept, nearest first: Chetverikov, Svirko, Stepanov, Krsek,
    "The trimmed iterative closest point algorithm" (2002). 1 where the whole source is seen in the target."""
    one_to_one: bool = True
    """A target point is the counterpart of one source point only, the nearest."""
    max_distance: float = math.inf
    """Longest correspondence [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "iterations", "tolerance")
        if not 0.0 < self.trim <= 1.0:
            raise ParameterError(self, "trim", "above 0 and at most 1")
        if not self.max_distance > 0.0:
            raise ParameterError(self, "max_distance", "above 0")

    def match(self, source: FloatArray, target: FloatArray, guess: SE2) -> Match:
        """Register a scan on another.

        The covariance is the inverse Gauss-Newton Hessian of the last pairs times their residual variance, which for
        independent, isotropic noise and small residuals is Censi's "An accurate closed-form estimate of ICP's covariance"
        (2007). Fixed pairs do not see a scan slide along a wall: along a corridor it claims too much.

        Args:
            source: (M, 2) points of the scan [m].
            target: (N, 2) points of the other scan [m]. Points that are not finite are left out of both.
            guess: T_target_source to start from.

        Returns:
            The match; the guess, not converged and of infinite covariance, where too few points found a counterpart.
        """
        steps = list(self.steps(source, target, guess))
        last = steps[-1]
        inliers = len(last.p) / max(len(source), 1)
        if not last.determined:
            return Match(guess, np.diag([math.inf] * 3), False, last.rms, inliers, len(steps) - 1)
        converged = last.change < self.tolerance and _orbit(steps) <= max(self.tolerance, ORBIT_SHARE * last.rms)
        return Match(last.T_target_source, _covariance(last), converged, last.rms, inliers, len(steps) - 1)

    def register(self, source: FloatArray, target: FloatArray, guess: SE2, prior: FloatArray | None = None) -> Match:
        """See `slam.matching.matchers.ScanMatcher`. Unlike that of `match`, the covariance knows that scans slide along walls."""
        match = self.match(source, target, guess)
        if not math.isfinite(match.covariance[0, 0]):
            return match
        target = target[np.isfinite(target).all(axis=1)]
        tree = cKDTree(target)

        def paired(at: FloatArray) -> Residuals:
            pose = SE2.from_array(at)
            return residuals(*self._pairs(pose.transform(source), target, tree), pose)

        pose = match.T_target_source.as_array()
        fisher = scan_information(source, match.T_target_source)
        away = np.array([*(pose - guess.as_array())[:2], wrap_angle(pose[2] - guess.yaw)])
        prior = no_prior() if prior is None else prior
        here, slope = paired(pose), measured_slope(paired, pose, source[np.isfinite(source).all(axis=1)])
        step, covariance = settle(blocks_of(here), slope, (away, prior), fisher, COMMON * max(match.rms, 0.01))
        T = SE2.from_array(pose + step)
        return Match(T, covariance, match.converged, match.rms, match.inliers, match.iterations, source)

    def steps(self, source: FloatArray, target: FloatArray, guess: SE2) -> Iterator[IcpStep]:
        """The guess and every pose after it, each with its correspondences; arguments as in `match`."""
        target = target[np.isfinite(target).all(axis=1)]
        tree = cKDTree(target)
        pose, change = guess, math.inf
        visited = [_coordinates(guess)]
        for _ in range(self.iterations):
            step = IcpStep(pose, *self._pairs(pose.transform(source), target, tree), change)
            yield step
            if change < self.tolerance or not step.determined:
                return
            pose = align(step.p, step.q) @ pose
            here = _coordinates(pose)
            change = float(np.abs(np.array(visited) - here).max(axis=1).min())
            visited.append(here)
        yield IcpStep(pose, *self._pairs(pose.transform(source), target, tree), change)

    def _pairs(self, source: FloatArray, target: FloatArray, tree: cKDTree) -> tuple[FloatArray, FloatArray]:
        """Points p (k, 2) of the moved source and q (k, 2) of the target that belong together, nearest pairs first."""
        p = source[np.isfinite(source).all(axis=1)]
        found = tree.query(p, distance_upper_bound=self.max_distance)
        distance, nearest = np.asarray(found[0], np.float64), np.asarray(found[1], np.int64)
        order = np.argsort(distance, kind="stable")
        order = order[np.isfinite(distance[order])]
        if self.one_to_one:
            _, first = np.unique(nearest[order], return_index=True)
            order = order[np.sort(first)]
        order = order[: math.ceil(self.trim * len(order))]
        return p[order], target[nearest[order]]


def align(p: FloatArray, q: FloatArray) -> SE2:
    """Rigid motion that moves points p (k, 2) [m] nearest to their counterparts q (k, 2) [m], in the least squares sense.

    Means are over these pairs alone. For C = U S V_h from (q - mean q)^T (p - mean p), R = U diag(1, det(U V_h)) V_h; the
    determinant keeps near-collinear points from being reflected: Umeyama, "Least-squares estimation of transformation
    parameters between two point patterns" (1991), eq. 40-42.
    """
    mean_p, mean_q = p.mean(axis=0), q.mean(axis=0)
    C = (q - mean_q).T @ (p - mean_p)
    U, _, V_h = np.linalg.svd(C)
    R = U @ np.diag([1.0, np.linalg.det(U @ V_h)]) @ V_h
    t = mean_q - R @ mean_p
    return SE2(t[0], t[1], math.atan2(R[1, 0], R[0, 0]))


def residuals(p: FloatArray, q: FloatArray, T_target_source: SE2) -> Residuals:
    """Two for each pair of points p (k, 2) and q (k, 2) [m], in the order in which the robot sees them."""
    seen = p - [T_target_source.x, T_target_source.y]
    order = np.argsort(np.arctan2(seen[:, 1], seen[:, 0]), kind="stable")
    p, q, seen = p[order], q[order], seen[order]
    one, none = np.ones(len(p)), np.zeros(len(p))
    J = np.stack([np.column_stack([one, none, -seen[:, 1]]), np.column_stack([none, one, seen[:, 0]])], axis=1).reshape(-1, 3)
    return J, (p - q).reshape(-1), np.ones(2 * len(p)), np.repeat(p, 2, axis=0), 2 * len(p)


def measured_slope(paired: Callable[[FloatArray], Residuals], pose: FloatArray, source: FloatArray) -> FloatArray:
    """How the gradient changes over `STEP` to both sides of the pose (3,), with the pairs found anew, (3, 3)."""
    reach = max(float(np.sqrt((source**2).sum(axis=1).mean())), STEP)
    slope = np.empty((3, 3))
    for axis, step in enumerate((STEP, STEP, STEP / reach)):
        (J1, r1, *_), (J0, r0, *_) = (paired(pose + side * step * np.eye(3)[axis]) for side in (1.0, -1.0))
        slope[:, axis] = (J1.T @ r1 - J0.T @ r0) / (2.0 * step)
    return usable(slope, reach)


def _coordinates(pose: SE2) -> FloatArray:
    """(x, y, cos yaw, sin yaw): continuous where the heading wraps."""
    return np.array([pose.x, pose.y, math.cos(pose.yaw), math.sin(pose.yaw)])


def _orbit(steps: list[IcpStep]) -> float:
    """Extent of the poses from the one to which the last step came back; next to nothing where it came to rest."""
    poses = np.array([_coordinates(step.T_target_source) for step in steps])
    start = int(np.abs(poses[:-1] - poses[-1]).max(axis=1).argmin())
    return float(np.ptp(poses[start:], axis=0).max())


def _covariance(step: IcpStep) -> FloatArray:
    """(3, 3) of (x, y, yaw) in the target frame: the mean of the pairs and the turn about it are independent."""
    k, T = len(step.p), step.T_target_source
    variance = k * step.rms**2 / (2 * k - 3)
    lever = step.p.mean(axis=0) - [T.x, T.y]
    G = np.array([[1.0, 0.0, lever[1]], [0.0, 1.0, -lever[0]], [0.0, 0.0, 1.0]])
    return variance * G @ np.diag([1.0 / k, 1.0 / k, 1.0 / step.spread]) @ G.T
