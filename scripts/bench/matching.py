"""Scan matching: time, error and honesty of all matchers on the same pairs, beside karto-scanmatcher and small_gicp."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import rankdata

from scripts.bench.matching_peers import PEERS
from scripts.bench.row import Row
from scripts.bench.still_scans import StillPair, StillScans
from sim.ground_truth import ground_truth
from sim.robot import Sim
from slam.mapping.grid_mapper import GridMapper, MapSettings
from slam.matching.gauss_newton import GaussNewton
from slam.matching.localizability import Localizability
from slam.matching.match import Match
from slam.matching.matchers import MATCHERS
from slam.matching.plicp import PlIcp
from slam.motion.dead_reckoning import DeadReckoning
from slam.navigation.tour import Tour, TourPolicy
from slam.scans import PointScan, deskew
from slam.se2 import SE2, wrap_angle
from worlds.loader import load_world

PRIOR = np.diag([0.05**2, 0.05**2, 0.03**2])
"""Covariance of the disturbance of the guess: 5 cm, 5 cm, 1.7 deg."""
WORLDS = ("aruco_room", "office", "apartment")
APART, TURNED = (0.05, 0.5), (0.0, 0.3)
"""Pairs: how far apart [m] and turned [rad]."""
CHI_SQUARE = 7.815
"""95 % of a chi-square of three degrees of freedom lie below it."""
DEGENERATE = 0.05
"""Cramér-Rao bound of a pose that a scan cannot tell [m]."""
COVERED = {"icp": 100, "correlative": 300}
"""Pairs for the covariance of those that are slow; 2000 for the others."""


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """Pairs with a disturbed guess each."""

    pairs: list[StillPair]
    guesses: list[SE2]

    @classmethod
    def of(cls, count: int) -> Tried:
        """So many pairs, alike from all worlds."""
        each = math.ceil(count / len(WORLDS))
        pairs = [pair for world in WORLDS for pair in itertools.islice(StillScans(world).pairs(7, APART, TURNED), each)]
        shifts = np.random.default_rng(0).multivariate_normal(np.zeros(3), PRIOR, len(pairs))
        order = np.random.default_rng(1).permutation(len(pairs))  # so that the first ones are of all worlds too
        guesses = [SE2.from_array(pair.T_target_source.as_array() + shift) for pair, shift in zip(pairs, shifts, strict=True)]
        return cls([pairs[k] for k in order], [guesses[k] for k in order])


def run(smoke: bool) -> list[Row]:
    """Scan-to-map, scan-to-scan, covariance, corridor."""
    tried = Tried.of(12 if smoke else 2000)
    return [
        *_map_rows(4.0 if smoke else 20.0),
        _plicp_row(tried, 12 if smoke else 300),
        *_pair_rows(tried, 3 if smoke else 100),
        *_covariance_rows(tried),
        _corridor_row(20 if smoke else 1000),
    ]


def _map_rows(duration: float) -> list[Row]:
    """Every other scan of a drive through `aruco_room` makes the map at its true pose, the others are matched on it."""
    scans = _drive(duration)
    mapper = GridMapper(MapSettings())
    for pose, scan in scans[::2]:
        mapper.insert(pose, scan.points, scan.origins)
    rng, matcher = np.random.default_rng(0), GaussNewton()
    times, errors = [], []
    for pose, scan in scans[1::2] * 5:
        guess = SE2.from_array(pose.as_array() + rng.multivariate_normal(np.zeros(3), PRIOR))
        began = time.thread_time()
        match = matcher.match(mapper.field, scan.points, guess, PRIOR, 0.2)
        times.append(time.thread_time() - began)
        errors.append(_error(match.T_target_source, pose))
    position, heading = np.sqrt(np.mean(np.square(errors), axis=0))
    beams = float(np.median([len(scan.points) for _, scan in scans]))
    took = 1e6 * float(np.median(times[1:]))
    return [
        Row(
            "matching",
            f"`gauss_newton` on a map, {beams:.0f} valid of 682 beams, median",
            took,
            "µs",
            "≤ 100",
            "rf2o, published",
            900.0,
            900.0 / took,
        ),
        Row("matching", "position error on a map after a guess 5 cm, 1.7 deg off, RMS", 1e3 * float(position), "mm"),
        Row("matching", "heading error on a map after a guess 5 cm, 1.7 deg off, RMS", float(np.degrees(heading)), "deg"),
    ]


def _plicp_row(tried: Tried, count: int) -> Row:
    """Pairs a second, each with its target prepared."""
    matcher, times = PlIcp(), []
    for pair, guess in zip(tried.pairs[:count], tried.guesses, strict=False):
        began = time.thread_time()
        matcher.register(pair.source, pair.target, guess, PRIOR)
        times.append(time.thread_time() - began)
    rate = 1.0 / float(np.median(times[1:]))
    return Row("matching", "`plicp` pairs, 682 beams", rate, "1/s", "≥ 3000", "CSM, published", 115.0, rate / 115.0)


def _pair_rows(tried: Tried, count: int) -> list[Row]:
    """Time and median error of one pair, ours and others'."""
    rows: list[Row] = []
    chosen = list(zip(tried.pairs[:count], tried.guesses, strict=False))
    works = {f"`{name}`": [_ours(name, pair, guess) for pair, guess in chosen] for name in MATCHERS}
    works |= {name: [peer(pair.source, pair.target, guess) for pair, guess in chosen] for name, peer in PEERS.items()}
    measured = {name: _measure(some, [pair.T_target_source for pair, _ in chosen]) for name, some in works.items()}
    best = min(measured[name][1] for name in PEERS)
    for name, (took, position, heading) in measured.items():
        what = f"{name}, scan to scan"
        rows.append(Row("matching", f"{what}, median time", 1e3 * took, "ms"))
        rows.append(Row("matching", f"{what}, median error", 1e3 * position, "mm", "", "best of the peers", 1e3 * best, best / position))
        rows.append(Row("matching", f"{what}, median error of heading", math.degrees(heading), "deg"))
    return rows


def _ours(name: str, pair: StillPair, guess: SE2) -> Callable[[], SE2]:
    matcher = MATCHERS[name]()
    return lambda: matcher.register(pair.source, pair.target, guess, PRIOR).T_target_source


def _measure(works: list[Callable[[], SE2]], truths: list[SE2]) -> tuple[float, float, float]:
    """Median time [s], error of the position [m] and of the heading [rad]."""
    works[0]()
    times, errors = [], []
    for work, truth in zip(works, truths, strict=True):
        began = time.thread_time()
        found = work()
        times.append(time.thread_time() - began)
        errors.append(_error(found, truth))
    position, heading = np.median(errors, axis=0)
    return float(np.median(times)), float(position), float(heading)


def _covariance_rows(tried: Tried) -> list[Row]:
    """Share of the pairs whose error the covariance covers as it claims to."""
    rows: list[Row] = []
    for name, kind in MATCHERS.items():
        matcher, count = kind(), min(COVERED.get(name, 2000), len(tried.pairs))
        squares = [
            _mahalanobis(matcher.register(pair.source, pair.target, guess, PRIOR), pair.T_target_source)
            for pair, guess in zip(tried.pairs[:count], tried.guesses, strict=False)
        ]
        share = 100.0 * float(np.mean(np.array(squares) < CHI_SQUARE))
        what = f"`{name}`, covariance: share of {count} pairs below the chi-square 95 % point"
        rows.append(Row("matching", what, share, "%", "92-98" if name == "gauss_newton" else "", "NDT, published", 40.0))
    return rows


def _corridor_row(count: int) -> Row:
    """How well the bound from a scan alone tells the poses of which the true bound is above 5 cm."""
    scans, rng = StillScans("corridor"), np.random.default_rng(5)
    predicted, true = [], []
    for _ in range(count):
        pose = SE2(rng.uniform(0.7, 13.3), rng.normal(0.0, 0.1), rng.normal(0.0, 0.1) + math.pi * rng.integers(2))
        predicted.append(Localizability.of(scans.points(scans.lidar(rng), pose), pose).weakest)
        true.append(Localizability.from_information(scans.information(pose)).weakest > DEGENERATE)
    return Row("matching", f"`corridor`, degenerate poses told by their scans, {count} poses, AUC", _auc(predicted, true), "", "≥ 0.99")


def _auc(scores: list[float], labels: list[bool]) -> float:
    """Share of the pairs of a labelled and another that the score orders rightly."""
    ranks, marked = rankdata(scores), np.array(labels)
    n = int(marked.sum())
    return float((ranks[marked].sum() - 0.5 * n * (n + 1)) / (n * (len(scores) - n)))


def _error(found: SE2, truth: SE2) -> tuple[float, float]:
    """Of the position [m] and of the heading [rad]."""
    error = truth.inverse() @ found
    return math.hypot(error.x, error.y), abs(error.yaw)


def _mahalanobis(match: Match, truth: SE2) -> float:
    """Squared."""
    error = match.T_target_source.as_array() - truth.as_array()
    error[2] = wrap_angle(float(error[2]))
    return float(error @ np.linalg.solve(match.covariance, error))


def _drive(duration: float) -> list[tuple[SE2, PointScan]]:
    """True poses and deskewed scans of a tour driven on the truth."""
    world = load_world("aruco_room")
    policy = TourPolicy(Tour(), np.array(world.tour))
    motion = DeadReckoning()
    scans: list[tuple[SE2, PointScan]] = []
    with Sim(world="aruco_room", seed=1).build() as robot:
        truth = ground_truth(robot)
        while robot.clock.now() < duration:
            robot.clock.sleep_until(robot.clock.now() + 0.1)
            frame = robot.read()
            robot.drive(policy.pursue(truth.pose(frame.stamp)))
            motion.add(frame.odometry, frame.imu)
            scans += [(truth.pose(scan.stamp), deskew(scan, motion.window(scan.stamp))) for scan in frame.scans]
    return scans
