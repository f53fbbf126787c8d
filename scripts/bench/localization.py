"""`twin bench localization`: how fast and how exact the particle filters are, and whether moved furniture loses them."""

from __future__ import annotations

import importlib.util
import math
import statistics
import time
from collections.abc import Callable, Iterator

import numpy as np

from scripts.bench.row import Row
from scripts.experiments.arena import Outcome, errors_in, follow, mapped, rmse, start_in
from scripts.experiments.drive import STILL, Course
from scripts.runs.known_map import GivenMap
from slam.localization.amcl import Amcl
from slam.localization.beam_model import BeamModel
from slam.localization.belief import Belief, Filtering
from slam.localization.motion_models import OdometryMotion
from slam.localization.particles import Particles
from slam.localization.resampling import Kld
from slam.localization.sensor_models import Likelihood, LikelihoodField
from slam.messages import LaserScan
from slam.pipelines import warm_up
from slam.scans import PointScan, deskew
from slam.se2 import SE2

GROUP = "localization"
UPDATES = ((2_000, 60, 0.5, 1.55), (10_000, 100, 3.0, 7.8), (100_000, 100, 30.0, 82.0))
"""Particles, beams, what is asked [ms] and what Beluga has published with 100 beams on an i9-9900 [ms]."""
TOURS = {"aruco_room": 60.0, "office": 380.0}
"""Worlds and how long it takes to see all of them [s]."""
SPREAD = np.diag([0.05**2, 0.05**2, 0.03**2])
LOST = 0.5
"""An estimate that is farther off at the end, or says so itself, is lost [m]."""


def run(smoke: bool) -> Iterator[Row]:
    """All rows, as they are known."""
    room = mapped("aruco_room", 20.0 if smoke else TOURS["aruco_room"])
    yield from _speed(room, smoke)
    yield from _beam_model(room, smoke)
    yield from _tracking("aruco_room", room, smoke)
    if not smoke:
        office = mapped("office", TOURS["office"])
        yield from _tracking("office", office, smoke)
        yield _moved(office)


def _speed(given: GivenMap, smoke: bool) -> list[Row]:
    """Full updates: motion, weights, averages, modes, resampling."""
    scan, T_map_base = _scan_in(given)
    likelihood = LikelihoodField().over(given.known, scan.range_max)
    rows: list[Row] = []
    for particles, beams, asked, beluga in UPDATES:
        work = _update(given, likelihood, deskew(scan, STILL), T_map_base, (particles, beams))
        taken = 1e3 * _cpu_time(work, 3 if smoke else 25)
        name = f"full update, likelihood field, {particles} particles x {beams} beams"
        rows.append(Row(GROUP, name, taken, "ms", f"≤ {asked:g}", "Beluga, published", beluga, beluga / taken))
    return rows


def _beam_model(given: GivenMap, smoke: bool) -> list[Row]:
    scan, T_map_base = _scan_in(given)
    likelihood = BeamModel().over(given.known, scan.range_max)
    ours = _cpu_time(_update(given, likelihood, deskew(scan, STILL), T_map_base, (2000, 60)), 3 if smoke else 15)
    name = "full update, beam model, 2000 particles x 60 beams"
    if importlib.util.find_spec("amcl") is None:  # under the GPL, so that nothing asks for it
        return [Row(GROUP, name, 1e3 * ours, "ms", "≤ 15", "PyPI amcl, not installed")]
    updates = importlib.import_module("scripts.bench.amcl_peer").updates
    peer = _cpu_time(updates(given.known, scan, T_map_base, 2000, 60), 3 if smoke else 15)
    return [Row(GROUP, name, 1e3 * ours, "ms", "≤ 15", "PyPI amcl", 1e3 * peer, peer / ours)]


def _tracking(world: str, given: GivenMap, smoke: bool) -> list[Row]:
    """Ten tours with other noise than the map's; and what 2 000 particles with all beams cost."""
    warm_up(Amcl().build(given.known, SE2()))
    seeds, duration = ((1,), 10.0) if smoke else (range(1, 11), 100.0)
    positions, headings, shares = list[float](), list[float](), list[float]()
    for seed in seeds:
        drive = Course(world, duration, seed).drive()
        outcome = follow(Amcl().build(given.known, start_in(given, drive)), drive)
        errors = errors_in(given, drive, outcome.estimate)
        positions.append(1e3 * rmse(errors.position))
        headings.append(math.degrees(rmse(errors.yaw)))
        many = follow(_with_particles(2000).build(given.known, start_in(given, drive)), drive)
        shares.append(100.0 * 1e-3 * float(many.update_ms.sum()) / duration)
    return [
        Row(GROUP, f"{world}, position RMSE, median of seeds", statistics.median(positions), "mm", "≤ 15", "Beluga, published", 28.0),
        Row(GROUP, f"{world}, position RMSE, worst seed", max(positions), "mm"),
        Row(GROUP, f"{world}, heading RMSE, median of seeds", statistics.median(headings), "deg", "≤ 0.4"),
        Row(GROUP, f"{world}, heading RMSE, worst seed", max(headings), "deg"),
        Row(GROUP, f"{world}, 10 Hz, all beams, 2000 particles", statistics.median(shares), "% of a core", "≤ 3", "nav2, 60 beams", 3.0),
    ]


def _moved(given: GivenMap, runs: int = 100) -> Row:
    """Tours of an office in which three of ten pieces of furniture stand elsewhere than in the map."""
    lost = 0
    for seed in range(1, runs + 1):
        drive = Course(f"office:moved=0.3,seed={seed}", 60.0, seed).drive()
        outcome = follow(Amcl().build(given.known, start_in(given, drive)), drive)
        lost += _is_lost(outcome, float(errors_in(given, drive, outcome.estimate).position[-1]))
    return Row(GROUP, f"office, 30 % of the furniture moved, lost of {runs} runs", float(lost), "runs", "0")


def _is_lost(outcome: Outcome, last_error: float) -> bool:
    return last_error > LOST or outcome.statuses[-1] in ("lost", "ambiguous")


def _with_particles(count: int) -> Amcl:
    return Amcl(filtering=Filtering(sample_size=Kld(count, count)))


def _scan_in(given: GivenMap) -> tuple[LaserScan, SE2]:
    """A scan from the middle of a drive, and where it was taken."""
    drive = Course("aruco_room", 8.0, 1).drive()
    scan = drive.scans[len(drive.scans) // 2]
    return scan, given.T_world_map.inverse() @ drive.pose(scan.stamp)


def _update(given: GivenMap, likelihood: Likelihood, cloud: PointScan, T_map_base: SE2, sizes: tuple[int, int]) -> Callable[[], object]:
    """One update of a filter that has as many particles before and after it."""
    rng = np.random.default_rng(1)
    filtering = Filtering(beams=sizes[1], sample_size=Kld(sizes[0], sizes[0]), resample_below=1.0)
    particles = Particles.about(T_map_base, SPREAD, sizes[0], rng)
    belief = Belief(filtering, given.known, particles, rng)
    step = (SE2(0.05, 0.0, 0.02), 0.2)

    def work() -> None:
        belief.particles = particles
        belief.update(OdometryMotion(), step, likelihood, cloud)

    return work


def _cpu_time(work: Callable[[], object], repeats: int) -> float:
    """Median CPU time of `work` [s], after two warm-ups."""
    times: list[float] = []
    for _ in range(repeats + 2):
        began = time.thread_time()
        work()
        times.append(time.thread_time() - began)
    return statistics.median(times[2:])
