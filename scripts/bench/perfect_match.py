"""`twin bench perfect_match`: document B's matching optimisation, its speed and from how far it converges."""

from __future__ import annotations

import time

import numpy as np

from scripts.bench.row import Row, median_time
from scripts.experiments.arena import follow, map_of, start_in
from scripts.experiments.corridor import every_scan
from scripts.experiments.drive import STILL, Course, Drive
from scripts.runs.known_map import GivenMap
from slam.localization.error_table import ErrorTable, TableSettings
from slam.localization.matching_optimisation import MatchingOptimisation
from slam.localization.perfect_match import PerfectMatch
from slam.messages import LaserScan
from slam.scans import Unveil, deskew
from slam.se2 import SE2, FloatArray

GROUP = "perfect_match"
FAR = np.array([0.3, 0.3, 0.3])
"""Largest error of a start [m, m, rad]."""
WIDE = np.diag([1.0, 1.0, 1.0])
"""Covariance of a start that is hardly known [m, rad]."""
NEAR = np.diag([0.005**2, 0.005**2, 0.005**2])
"""Covariance of odometry's guess from scan to scan [m, rad]."""
RIGHT = 0.1
"""Error below which a start has converged [m]; most of it is the map's own."""


def run(smoke: bool) -> list[Row]:
    """Rows of speed and convergence."""
    return [*_corridor_rows(6.0 if smoke else 40.0), *_room_rows(8.0 if smoke else 60.0)]


def _corridor_rows(duration: float) -> list[Row]:
    drive = Course("corridor", duration, 1).drive()
    given = map_of(Course("corridor", duration, 101).drive())
    start = start_in(given, drive)
    pipelines = PerfectMatch().build(given.known, start), every_scan().build(given.known, start)
    ours, theirs = (float(np.median(follow(pipeline, drive).update_ms)) for pipeline in pipelines)
    settings, table = MatchingOptimisation(), TableSettings().of(given.known.grid)
    times: list[float] = []
    for scan in drive.scans[1:]:
        points, guess = _points(scan), given.T_world_map.inverse() @ drive.pose(scan.stamp)
        began = time.thread_time()
        settings.match(table, points, guess.as_array()[None], guess, (NEAR, NEAR))
        times.append(1e3 * (time.thread_time() - began))
    return [
        Row(GROUP, "corridor, matching of one scan, median", float(np.median(times)), "ms CPU", "≤ 0.5"),
        Row(
            GROUP,
            "corridor, whole update, median",
            ours,
            "ms CPU",
            "≤ 0.5 of peer",
            "amcl, 2000 particles, same beams",
            theirs,
            theirs / ours,
        ),
    ]


def _room_rows(duration: float) -> list[Row]:
    drive = Course("aruco_room", duration, 1).drive()
    given = map_of(Course("aruco_room", duration, 101).drive())
    settings = TableSettings()
    table = settings.of(given.known.grid)
    errors = _from_afar(given, drive, table)
    return [
        Row(GROUP, "aruco_room, starts within 0.3 m, 0.3 rad that converge", 100.0 * float(np.mean(errors < RIGHT)), "%", "100"),
        Row(GROUP, "aruco_room, median position error from there", 1e3 * float(np.median(errors)), "mm"),
        Row(GROUP, "aruco_room, segments and table made", 1e3 * median_time(lambda: settings.of(given.known.grid), 3), "ms"),
    ]


def _from_afar(given: GivenMap, drive: Drive, table: ErrorTable) -> FloatArray:
    """Position errors (N,) [m] of single scans that are matched from a start somewhere about the truth."""
    rng = np.random.default_rng(0)
    errors: list[float] = []
    for scan in drive.scans[1::2]:
        truth = given.T_world_map.inverse() @ drive.pose(scan.stamp)
        start = truth.as_array() + rng.uniform(-FAR, FAR)
        found = MatchingOptimisation().match(table, _points(scan), start[None], SE2.from_array(start), (WIDE, WIDE))
        off = truth.inverse() @ found.T_map_base
        errors.append(float(np.hypot(off.x, off.y)))
    return np.array(errors)


def _points(scan: LaserScan) -> FloatArray:
    return deskew(Unveil().clean(scan), STILL).points
