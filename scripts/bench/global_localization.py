"""`twin bench global_localization`: where a scan was taken, from nothing."""

from __future__ import annotations

import math
import os
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scripts.bench.lookalikes import Lookalikes
from scripts.bench.row import Row
from scripts.bench.still_scans import StillScans
from scripts.experiments.arena import mapped
from scripts.runs.known_map import GivenMap, read_given_map
from slam.localization.global_search import GlobalSearch
from slam.localization.panoramas import Panoramas
from slam.localization.whole_scan import clear_ends
from slam.messages import LaserScan, Trajectory
from slam.scans import Unveil, deskew
from slam.se2 import SE2

GROUP = "global_localization"
WORLDS, MAPS = ("office", "apartment"), ("turtlebot3_map", "nav2_depot")
RIGHT = (0.3, math.radians(10.0))
"""Errors below which an answer is right [m], [rad]."""
STILL = Trajectory(np.empty(0), np.empty((0, 3)))
TOUR = 190.0
"""Length of the tours [s]."""
SEED = 2718
"""Of the poses: no parameter was chosen on them."""


@dataclass(frozen=True, slots=True)
class _Trial:
    unambiguous: bool
    unique: bool
    right: bool
    took: float
    """CPU time [s]."""


def run(smoke: bool) -> list[Row]:
    """All rows; those of the public maps only where there are any."""
    rows: list[Row] = []
    for world in WORLDS[: 1 if smoke else 2]:
        rows += _found(world, world, mapped(world, 40.0 if smoke else TOUR), 4 if smoke else 200)
    folder = Path(os.environ.get("BRICKTWIN_DATA", Path(__file__).parents[3] / "shared" / "data")) / "maps"
    for name in () if smoke else MAPS:
        file = folder / f"{name}.yaml"
        if file.is_file():
            rows += _found(name, f"map:file={file}", read_given_map(file), 200)
    return rows


def _found(name: str, world: str, given: GivenMap, count: int) -> list[Row]:
    """One scan each from poses anywhere in the free space."""
    began = time.process_time()
    Panoramas.of(given.known.grid)
    built = time.process_time() - began
    trials = _trials(world, given, count)
    sure = [trial for trial in trials if trial.unambiguous]
    found = sum(trial.unique and trial.right for trial in sure) / max(len(sure), 1)
    wrong = sum(trial.unique and not trial.right for trial in trials) / len(trials)
    took = np.array([trial.took for trial in trials[1:]])
    return [
        Row(GROUP, f"`{name}`, unique and right, of {len(sure)} unambiguous poses of {len(trials)}", 100.0 * found, "%", "≥ 90"),
        Row(GROUP, f"`{name}`, confidently wrong, of all", 100.0 * wrong, "%", "≤ 1"),
        Row(GROUP, f"`{name}`, time of a search, median", 1e3 * float(np.median(took)), "ms", "≤ 200", "mcl_3dl, published", 4800.0),
        Row(GROUP, f"`{name}`, time of a search, longest", 1e3 * float(took.max()), "ms", "≤ 200"),
        Row(GROUP, f"`{name}`, views of the whole map, once", built, "s"),
    ]


def _trials(world: str, given: GivenMap, count: int) -> list[_Trial]:
    scans, look, rng = StillScans(world), Lookalikes(world), np.random.default_rng(SEED)
    trials: list[_Trial] = []
    while len(trials) < count:
        x, y = given.known.free_points[rng.integers(len(given.known.free_points))]
        T_map_base = SE2(x, y, rng.uniform(-math.pi, math.pi))
        pose = given.T_world_map @ T_map_base
        if look.reaches(pose) and scans.stands(pose):
            trials.append(_trial(given, T_map_base, scans.scan(scans.lidar(rng), pose), look.elsewhere(pose) is None))
    return trials


def _trial(given: GivenMap, T_map_base: SE2, scan: LaserScan, unambiguous: bool) -> _Trial:
    cloud, clear = deskew(Unveil().clean(scan), STILL), clear_ends(scan, STILL)
    began = time.thread_time()
    answer = GlobalSearch().search(given.known, cloud.points, cloud.origins, clear)
    took = time.thread_time() - began
    if not answer.hypotheses:
        return _Trial(unambiguous, False, False, took)
    off = T_map_base.inverse() @ answer.hypotheses[0].T_map_base
    right = math.hypot(off.x, off.y) < RIGHT[0] and abs(off.yaw) < RIGHT[1]
    return _Trial(unambiguous, not answer.ambiguous, right, took)
