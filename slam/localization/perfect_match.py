"""The `perfect_match` pipeline: document B's matching optimisation, Lauer, Lange, Riedmiller, "Calculating the perfect match" (2005).

Walls as segments, a table of distance and gradient made once, RPROP on the robust error of every scan, a covariance from its second
derivative, Kalman's fusion with odometry. Several starts are tried when the track may be lost, and all over the map when there is none.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, field

import numpy as np

from slam.depth_scans import DepthScan, Source, scans_of
from slam.errors import require_not_negative, require_positive
from slam.localization.error_table import TableSettings
from slam.localization.health import NOT_HERE, UNSUPPORTED, HealthWatch
from slam.localization.hypotheses import FITS, Hypotheses
from slam.localization.known_map import KnownMap
from slam.localization.matching_optimisation import Found, MatchingOptimisation, Prior
from slam.localization.mcl import without_wheels
from slam.localization.multi_start import MultiStart
from slam.localization.places import trouble_at
from slam.messages import Estimate, LaserScan, SensorFrame, Status
from slam.motion.ego_motion import EgoMotion
from slam.motion.motion_noise import MotionNoise
from slam.motion.scan_trajectory import ScanTrajectory
from slam.motion.sensor_watch import SensorWatch
from slam.scans import PointScan, Unveil
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot

DISTRUST = 1e4
"""Inflation of the covariance when odometry's guess fits nothing."""
GAIN = 0.1
"""So much more of the scan must another start explain to be believed."""
_log = logging.getLogger(__name__)

CHI2_99 = 11.34
"""99 % point of chi-square with 3 degrees of freedom."""
DRIFTING = np.diag([0.05**2, 0.05**2, 0.1**2])
"""Added to the covariance of a step (3, 3) that no wheels have measured [m, rad]."""
JUMP = 0.25
"""A correction beyond this is no motion [m]."""
MISSES = 3
"""Unusable matches in a row after which other starts are tried."""
LOST_AFTER, SEARCH_EVERY = 10, 5
"""Unusable matches in a row after which the track is lost, and scans between two searches of the whole map."""


@dataclass(frozen=True, slots=True)
class PerfectMatch:
    """Matching optimisation on an error table."""

    source: Source = "auto"
    """Where scans come from: the lidar, the depth images, or the lidar where there is one."""
    depth: DepthScan = field(default_factory=DepthScan)
    """How a depth image becomes a scan."""
    unveil: Unveil = field(default_factory=Unveil)
    table: TableSettings = field(default_factory=TableSettings)
    matching: MatchingOptimisation = field(default_factory=MatchingOptimisation)
    multi_start: MultiStart = field(default_factory=MultiStart)
    noise: MotionNoise = field(default_factory=MotionNoise)
    start_position: float = 0.1
    """Standard deviation of the told start [m]."""
    start_yaw: float = 0.1
    """Standard deviation of the told start's heading [rad]."""
    explained_min: float = 0.3
    """Share of a scan's points that must be on a wall for its match to count."""
    drop: float = 0.8
    """Other starts are tried when less than this share of what was usual is explained."""
    alternatives: int = 4
    """So many of them."""
    spread: float = 0.6
    """They lie so far from odometry's guess at most, along x and y [m]; as many radians it is turned at most."""
    seed: int = 0
    """Of the random stream of alternatives: the same seed gives the same bits."""

    def __post_init__(self) -> None:
        require_positive(self, "start_position", "start_yaw")
        require_not_negative(self, "explained_min", "drop", "alternatives", "spread", "seed")

    def build(self, known_map: KnownMap, T_map_base: SE2 | None = None) -> PerfectMatchPipeline:
        """Make the pipeline; the robot starts near `T_map_base`, or anywhere in the map when it is None."""
        return PerfectMatchPipeline(self, known_map, T_map_base)


class PerfectMatchPipeline:
    """One track that matching keeps right, or several places until the way tells which one it is."""

    def __init__(self, settings: PerfectMatch, known_map: KnownMap, T_map_base: SE2 | None) -> None:
        self._settings = settings
        self._map = known_map
        self._table = settings.table.kept(known_map)
        self._rng = np.random.default_rng(settings.seed)
        self._start_trouble = "" if T_map_base is None else trouble_at(known_map, T_map_base)
        if self._start_trouble:
            _log.warning("as a start, %s: it is looked for in the whole map", self._start_trouble)
            self._start_trouble, T_map_base = f"as a start, {self._start_trouble}; it is looked for", None
        self._ego = EgoMotion(settings.unveil, T_map_base or SE2(*known_map.free_points.mean(axis=0).tolist()))
        self._watch = SensorWatch()
        self._path = ScanTrajectory()
        self._covariance: FloatArray = np.diag([settings.start_position**2, settings.start_position**2, settings.start_yaw**2])
        self._places = None if T_map_base is not None else Hypotheses(settings.matching, self._table)
        if T_map_base is None:
            self._covariance = anywhere(known_map)
        self._inflation = 1.0  # of the odometry's covariance, from how far matching has corrected it
        self._typical, self._explained = 1.0, 1.0  # share of points on walls, of late and now
        self._misses, self._scans = 0, 0
        self._trouble = ""
        self._support = HealthWatch(UNSUPPORTED)

    def update(self, frame: SensorFrame) -> Estimate:
        """Take in one frame; answer with the pose at its stamp."""
        self._ego.hear(frame)
        for scan in scans_of(frame, self._settings.source, self._settings.depth):
            self._take(scan)
        return self._estimate(frame)

    def snapshot(self) -> Snapshot:
        """The map and the poses at scans so far; the places that are still possible stand as particles."""
        rows = np.empty((0, 4)) if self._places is None else self._places.as_rows()
        return Snapshot(self._map.grid, self._path.trajectory(), rows)

    def _take(self, scan: LaserScan) -> None:
        cloud = self._ego.points(scan)
        step = self._ego.step(scan.stamp)
        self._trouble = "" if len(cloud.points) else "the scan shows nothing"
        guess, prior = self._predicted(step, self._ego.wheels_cover(scan.stamp))
        if not len(cloud.points):
            pose, self._covariance = guess, prior[1]
        elif self._places is not None:
            pose = self._among_places(self._places, cloud, step, guess)
        else:
            pose = self._tracked(cloud, step, guess, prior)
            self._support.add(scan.stamp, self._explained)
        self._scans += 1
        off = guess.inverse() @ pose
        self._ego.settle(scan.stamp, pose, jumped=math.hypot(off.x, off.y) > JUMP)
        self._path.append(scan.stamp, pose)

    def _predicted(self, step: SE2, by_wheels: bool) -> tuple[SE2, Prior]:
        """Kalman's prediction by odometry: the pose, the covariance (3, 3) of the step, and of the pose in all."""
        last, noise = self._ego.T_map_base, self._settings.noise
        guess = last @ step
        of_step = noise.with_floor(step) * self._inflation + (0.0 if by_wheels else DRIFTING)
        in_all = noise.propagate(self._covariance, last, step) + (0.0 if by_wheels else DRIFTING)
        return guess, (of_step if self._scans else in_all, in_all)

    def _tracked(self, cloud: PointScan, step: SE2, guess: SE2, prior: Prior) -> SE2:
        """Match from odometry's guess; where that explains less than usual, from other starts too."""
        s = self._settings
        found = s.matching.match(self._table, cloud.points, guess.as_array()[None], guess, prior)
        first = found
        if self._doubtful(found, guess, prior):
            found = self._second_thoughts(cloud, guess, prior, found)
        self._explained = found.explained
        self._typical += 0.1 * (found.explained - self._typical)
        if found.explained < s.explained_min:
            self._misses += 1
            self._covariance = prior[1]
            self._give_up_when_lost()
            return guess
        self._misses = 0
        if found is first:
            self._learn(guess.inverse() @ found.T_map_base, step)
        self._covariance = np.array(found.covariance)
        return found.T_map_base

    def _doubtful(self, found: Found, guess: SE2, prior: Prior) -> bool:
        """Whether the track may be lost: one bad scan may be somebody near, and who agrees with odometry sees an open door."""
        s = self._settings
        if found.explained < s.explained_min:
            return self._misses >= MISSES
        off = found.T_map_base.as_array() - guess.as_array()
        off[2] = (guess.inverse() @ found.T_map_base).yaw
        return found.explained < s.drop * self._typical and float(off @ np.linalg.solve(prior[0], off)) > CHI2_99

    def _second_thoughts(self, cloud: PointScan, guess: SE2, prior: Prior, first: Found) -> Found:
        """Several start poses about the guess, which are believed when they explain clearly more."""
        s = self._settings
        off = self._rng.uniform(-s.spread, s.spread, (int(s.alternatives), 3))
        starts = np.concatenate([guess.as_array()[None], guess.as_array() + off])
        found = s.matching.match(self._table, cloud.points, starts, guess, (prior[0] * DISTRUST, prior[0] * DISTRUST))
        return found if found.explained > first.explained + GAIN else first

    def _learn(self, correction: SE2, step: SE2) -> None:
        """How wrong odometry is, from how far matching corrects it."""
        off = correction.as_array()
        surprise = float(np.mean(np.square(off) / np.diagonal(self._settings.noise.with_floor(step))))
        self._inflation = max(0.9 * self._inflation + 0.1 * surprise, 1.0)

    def _give_up_when_lost(self) -> None:
        if self._misses >= LOST_AFTER:
            self._places = Hypotheses(self._settings.matching, self._table)

    def _among_places(self, places: Hypotheses, cloud: PointScan, step: SE2, guess: SE2) -> SE2:
        """Follow all places that are possible, until one is left."""
        places.follow(cloud, step, self._settings.noise)
        if len(places) == 0 and self._scans % SEARCH_EVERY == 0:
            places.begin(self._settings.multi_start.search(self._map, self._table, self._settings.matching, cloud))
        best = places.best
        if best is None:
            return guess
        self._explained = best.explained
        self._covariance = places.covariance()
        if places.decided:
            self._start_trouble = ""
            self._places, self._misses, self._inflation = None, 0, 1.0
            self._support.forget()
            self._typical, self._covariance = best.explained, best.covariance
        return best.T_map_base

    def _estimate(self, frame: SensorFrame) -> Estimate:
        step = self._ego.step(frame.stamp)
        pose = self._ego.T_map_base @ step
        covariance = self._settings.noise.propagate(self._covariance, self._ego.T_map_base, step)
        status, reason = self._status(frame, pose)
        return Estimate(frame.stamp, pose, pose @ self._ego.motion.wheels.inverse(), covariance, status, self._explained, reason)

    def _status(self, frame: SensorFrame, pose: SE2) -> tuple[Status, str]:
        best = None if self._places is None else self._places.best
        if best is not None and best.explained < FITS:
            return Status.LOST, f"the best place in the map explains only {100.0 * best.explained:.0f} % of the scan"
        if self._places is not None and best is not None:
            return Status.AMBIGUOUS, f"{len(self._places)} places explain the scans about as well"
        if self._places is not None:
            nowhere = "no place in the map explains the scan" if self._scans else "no scan has come yet"
            return Status.LOST, "; ".join(filter(None, (nowhere, self._start_trouble)))
        if self._support.lost:
            return Status.LOST, NOT_HERE
        unmatched = "the scan does not match the map" if self._misses else ""
        reasons = unmatched, self._watch.silent(frame), without_wheels(self._ego, frame), self._trouble, trouble_at(self._map, pose)
        reason = "; ".join(dict.fromkeys(reason for reason in reasons if reason))
        return Status.DEGRADED if reason else Status.TRACKING, reason


def anywhere(known_map: KnownMap) -> FloatArray:
    """Covariance (3, 3) of a pose that may be anywhere in the free space [m, rad]."""
    spread = np.zeros((3, 3))
    spread[:2, :2] = np.cov(known_map.free_points.T) if len(known_map.free_points) > 1 else np.eye(2)
    spread[2, 2] = np.pi**2 / 3.0
    return spread
