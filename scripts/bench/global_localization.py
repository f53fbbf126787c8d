"""`twin bench global_localization`: where a scan was taken, from nothing; and where a robot is that was carried away."""

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
from scripts.experiments.arena import errors_in, follow, mapped, start_in
from scripts.experiments.drive import Course, Drive
from scripts.experiments.kidnap import kidnapped
from scripts.runs.known_map import GivenMap, read_given_map
from slam.localization.amcl import Amcl
from slam.localization.global_search import GlobalSearch
from slam.localization.panoramas import Panoramas
from slam.localization.whole_scan import clear_ends
from slam.messages import LaserScan, Status, Trajectory
from slam.scans import Unveil, deskew
from slam.se2 import SE2

GROUP = "global_localization"
WORLDS, MAPS = ("office", "apartment"), ("turtlebot3_map", "nav2_depot")
RIGHT = (0.3, math.radians(10.0))
"""Errors below which an answer is right [m], [rad]."""
STILL = Trajectory(np.empty(0), np.empty((0, 3)))
TOUR = 190.0
"""Length of the tours [s]."""
BEFORE, AFTER = 2.0, 5.0
"""Driving before and after a kidnapping [s]."""
CARRIED = 1.0
"""Least distance that a robot is carried away [m]."""


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
    given = {world: mapped(world, 40.0 if smoke else TOUR) for world in WORLDS[: 1 if smoke else 2]}
    for world, one in given.items():
        rows += _found(world, world, one, 4 if smoke else 200)
    folder = Path(os.environ.get("BRICKTWIN_DATA", Path(__file__).parents[3] / "shared" / "data")) / "maps"
    for name in () if smoke else MAPS:
        file = folder / f"{name}.yaml"
        if file.is_file():
            rows += _found(name, f"map:file={file}", read_given_map(file), 200)
    return rows + _kidnappings(given, 2 if smoke else 200) + _false_alarms(given, 10.0 if smoke else 3600.0)


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
    scans, look, rng = StillScans(world), Lookalikes(world), np.random.default_rng(5)
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


def _kidnappings(given: dict[str, GivenMap], count: int) -> list[Row]:
    """Robots of `amcl` carried to another place of their tour that looks like no other."""
    back: list[float] = []
    for world, one in given.items():
        drive, look, rng = Course(world, TOUR, 3).drive(), Lookalikes(world), np.random.default_rng(2)
        trials = 0
        while trials < count // len(given):
            until, since = rng.uniform(2.0 * BEFORE, drive.frames[-1].stamp - AFTER - 1.0, 2)
            here, there = drive.pose(until), drive.pose(since)
            if math.hypot(here.x - there.x, here.y - there.y) >= CARRIED and look.elsewhere(there) is None:
                back.append(_time_to_return(one, drive, until, since))
                trials += 1
    within = [one for one in back if math.isfinite(one)]
    share = 100.0 * len(within) / max(len(back), 1)
    return [
        Row(GROUP, f"kidnapped, back within 0.3 m after {AFTER:g} s, of {len(back)}", share, "%", "≥ 97"),
        Row(GROUP, "kidnapped, time to be back, median", float(np.median(within)) if within else math.nan, "s"),
    ]


def _time_to_return(given: GivenMap, drive: Drive, until: float, since: float) -> float:
    """Time [s] after which the error stays below 0.3 m; inf when it does not at the end."""
    course = kidnapped(drive, until, since, AFTER, until - BEFORE)
    outcome = follow(Amcl().build(given.known, start_in(given, course)), course)
    errors = errors_in(given, course, outcome.estimate)
    if errors.position[-1] >= RIGHT[0]:
        return math.inf
    far = errors.stamps[errors.position >= RIGHT[0]]
    return max(float(far[-1]) - (course.frames[0].stamp + BEFORE), 0.0) if len(far) else 0.0


def _false_alarms(given: dict[str, GivenMap], duration: float) -> list[Row]:
    """How often `amcl` says of a robot on its way that it is lost, or moves it by more than 0.3 m."""
    alarms = 0
    for world, one in given.items():
        drive = Course(world, duration / len(given), 7).drive()
        outcome = follow(Amcl().build(one.known, start_in(one, drive)), drive)
        off = errors_in(one, drive, outcome.estimate).position >= RIGHT[0]
        bad = off | np.array([status in (Status.LOST, Status.AMBIGUOUS) for status in outcome.statuses[: len(off)]])
        alarms += int(np.sum(bad[1:] & ~bad[:-1])) + int(bad[0])
    return [Row(GROUP, f"false alarms in {duration / 60.0:g} min of driving", float(alarms), "", "0")]
