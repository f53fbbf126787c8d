"""SLAM through the wire against the same in one process: same world, same tour."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from scripts.bench.row import Row
from scripts.bench.wire import SMOKE
from scripts.bench.wire.stage import emulated
from scripts.runs.execute import measure
from scripts.runs.options import RunOptions

TOUR = 60.0
"""[s]"""
SEEDS = (1, 2, 3)


def run(smoke: bool) -> list[Row]:
    """ATE of `lidar_slam` on the tour of aruco_room."""
    seeds, duration = (SEEDS[:1], SMOKE) if smoke else (SEEDS, TOUR)
    inside = [RunOptions(robot="kinematic", policy="tour", pipeline="lidar_slam", seed=seed, duration=duration) for seed in seeds]
    direct = float(np.median([_ate_mm(options) for options in inside]))
    wired = float(np.median([_through_the_wire(options) for options in inside]))
    name = f"lidar_slam through the wire, aruco_room, {duration:g} s: ATE, median of {len(seeds)} seeds"
    return [Row("wire", name, wired, "mm", "≤ 1.2 x in one process", "in one process", direct, direct / wired)]


def _through_the_wire(options: RunOptions) -> float:
    with TemporaryDirectory() as folder:
        truth = Path(folder) / "truth.tum"
        with emulated("--world", options.world, "--seed", str(options.seed), "--truth", str(truth)) as devices:
            return _ate_mm(replace(options, robot="ev3", seed=0, ev3=devices.brick, lidar=devices.lidar, truth=truth))


def _ate_mm(options: RunOptions) -> float:
    return 1e3 * measure(options).metrics["position_rmse_m"]
