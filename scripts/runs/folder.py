"""The folder that a run leaves behind."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from scripts.runs.animation import write_gif
from scripts.runs.body import Truth
from scripts.runs.files import OutputError, write_text
from scripts.runs.page import write_page
from scripts.runs.pictures import write_report_png
from scripts.runs.record import RunRecord
from slam.map_file import write_map
from slam.trajectory_file import write_trajectory

RESULTS = (
    *("trajectory.tum", "trajectory_final.tum", "odometry.tum", "truth.tum"),
    *("map.pgm", "map.yaml", "true_map.pgm", "true_map.yaml"),
    *("metrics.json", "report.png", "run.gif", "report.html"),
)
"""What a run writes beside config.toml and its recording."""


def prepare(folder: Path, config: Mapping[str, Any]) -> None:
    """Make the folder, remove the results of an earlier run in it and write what is needed to repeat this one.

    A recording is left alone: only another one takes its place.

    Raises:
        OutputError: it cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in RESULTS:
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(folder, error) from error
    write_text(folder / "config.toml", tomli_w.dumps(_without_none(config)))


def write_measurements(folder: Path, record: RunRecord, truth: Truth | None) -> None:
    """Write trajectories and maps: what cannot be had again.

    Raises:
        SlamError: a file cannot be written; the others are whole.
    """
    write_trajectory(folder / "trajectory.tum", record.estimate)
    write_trajectory(folder / "trajectory_final.tum", record.final)
    write_trajectory(folder / "odometry.tum", record.odometry)
    write_map(record.map, folder / "map")
    if truth is not None:
        write_trajectory(folder / "truth.tum", truth.trajectory)
        if truth.grid is not None:
            write_map(truth.grid, folder / "true_map")


def write_report(folder: Path, record: RunRecord) -> None:
    """Write metrics, pictures and the page that shows them.

    Raises:
        OutputError: a file cannot be written; the others are whole.
        TrajectoryError: truth and estimate do not overlap in time.
    """
    write_text(folder / "metrics.json", json.dumps(dict(record.metrics), indent=2) + "\n")
    write_report_png(folder / "report.png", record)
    write_gif(folder / "run.gif", record)
    write_page(folder / "report.html", record)


def _without_none(tree: Mapping[str, Any]) -> dict[str, Any]:
    """TOML has no null: options that were not given are left out."""
    return {key: _without_none(value) if isinstance(value, Mapping) else value for key, value in tree.items() if value is not None}
