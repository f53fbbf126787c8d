"""Scan matching: time of one scan-to-map match, and what it makes of a disturbed guess."""

from __future__ import annotations

import time

import numpy as np

from scripts.bench.row import Row
from sim.ground_truth import ground_truth
from sim.robot import Sim
from slam.mapping.dead_reckoning import DeadReckoning
from slam.mapping.grid_mapper import GridMapper, MapSettings
from slam.matching.gauss_newton import GaussNewton
from slam.navigation.tour import Tour, TourPolicy
from slam.scans import PointScan, deskew
from slam.se2 import SE2
from worlds.loader import load_world

PRIOR = np.diag([0.05**2, 0.05**2, 0.03**2])
"""Covariance of the disturbance of the guess: 5 cm, 5 cm, 1.7 deg."""


def run(smoke: bool) -> list[Row]:
    """Match every other scan of a drive through `aruco_room` on the map made of the rest of them at their true poses."""
    scans = _drive(4.0 if smoke else 20.0)
    mapper = GridMapper(MapSettings())
    for pose, scan in scans[::2]:
        mapper.insert(pose, scan.points, scan.origins)
    rng, matcher = np.random.default_rng(0), GaussNewton()
    times: list[float] = []
    errors: list[tuple[float, float]] = []
    for pose, scan in scans[1::2] * (1 if smoke else 10):
        guess = SE2.from_array(pose.as_array() + rng.multivariate_normal(np.zeros(3), PRIOR))
        began = time.perf_counter()
        match = matcher.match(mapper.field, scan.points, guess, PRIOR, 0.2)
        times.append(time.perf_counter() - began)
        error = pose.inverse() @ match.T_target_source
        errors.append((float(np.hypot(error.x, error.y)), abs(error.yaw)))
    position, heading = np.sqrt(np.mean(np.square(errors), axis=0))
    beams = float(np.median([len(scan.points) for _, scan in scans]))
    return [
        Row("matching", f"scan-to-map match, {beams:.0f} valid of 682 beams, median", 1e6 * float(np.median(times[1:])), "µs", "≤ 150"),
        Row("matching", "position error after a guess 5 cm, 1.7 deg off, RMS", 1e3 * float(position), "mm"),
        Row("matching", "heading error after a guess 5 cm, 1.7 deg off, RMS", float(np.degrees(heading)), "deg"),
    ]


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
