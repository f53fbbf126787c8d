"""Accuracy of the main job over seeds."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from scripts.bench.row import Row
from scripts.runs.execute import execute
from scripts.runs.options import RunOptions

FIGURES = (
    ("position_rmse_m", "position RMSE", "mm", 1e3, "≤ 20", max),
    ("heading_rmse_deg", "heading RMSE", "deg", 1.0, "≤ 0.5", max),
    ("odometry_ratio", "wheel odometry's position RMSE, of ours", "x", 1.0, "≥ 4", min),
    ("wall_rms_m", "wall_rms", "mm", 1e3, "≤ 15", max),
    ("wall_recall", "wall_recall", "%", 1e2, "≥ 95", min),
    ("real_time_factor", "whole loop with recording", "x real time", 1.0, "", min),
)


def run(smoke: bool) -> list[Row]:
    """The demo with seeds 1-10: median and worst of each figure."""
    seeds = range(1, 2 if smoke else 11)
    duration = 10.0 if smoke else None
    with tempfile.TemporaryDirectory() as folder:
        runs = [
            execute(RunOptions(seed=seed, duration=duration, record=True, out=Path(folder) / str(seed))).record.metrics for seed in seeds
        ]
    rows: list[Row] = []
    for key, name, unit, scale, reach, worst in FIGURES:
        values = [scale * run[key] for run in runs]
        rows.append(Row("demo", f"{name}, median of {len(values)} seeds", float(np.median(values)), unit, reach))
        rows.append(Row("demo", f"{name}, worst seed", worst(values), unit))
    return rows
