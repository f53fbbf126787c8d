"""The folder that a run leaves behind."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomli_w

from hardware.logs.mcap_bag import RECORDING, UNFINISHED
from scripts.errors import UsageError
from scripts.runs.animation import write_gif
from scripts.runs.body import OF_THE_HARDWARE, OF_THE_SIMULATION, Truth, is_twin, recording_of
from scripts.runs.files import OutputError, write_text
from scripts.runs.options import RunOptions
from scripts.runs.page import write_page
from scripts.runs.particle_picture import write_particles_png
from scripts.runs.pictures import write_report_png
from scripts.runs.record import RunRecord
from slam.hits_file import write_hits
from slam.map_file import write_map
from slam.trajectory_file import write_trajectory

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

RESULTS = (
    *("trajectory.tum", "trajectory_final.tum", "odometry.tum", "truth.tum"),
    *("map.pgm", "map.yaml", "map.hits.npz", "true_map.pgm", "true_map.yaml"),
    *("metrics.json", "report.png", "run.gif", "report.html"),
)
"""What a run writes beside config.toml and its recording."""
OF_SOME = ("particles.png", "markers.png", "markers.gif")
"""What runs of some pipelines write too."""


def results_folder(options: RunOptions) -> Path:
    """`--out`, else `runs/BODY-PIPELINE`, where BODY is the world or the name of the recording.

    Raises:
        UsageError: it is the folder of the recording that is replayed: a run's config and its recording belong together.
    """
    recording = recording_of(options)
    body = Path(options.world.split(":")[0]).stem if recording is None else _name_of(recording.resolve())
    folder = options.out or Path("runs") / f"{body}-{options.pipeline}"
    home = recording if recording is None or recording.is_dir() else recording.parent
    if home is not None and folder.resolve() == home.resolve():
        raise UsageError(f"--out {folder} holds the recording that is replayed; name another folder")
    return folder


def config_of(options: RunOptions, settings: DataclassInstance) -> dict[str, Any]:
    """What is needed to repeat a run, with every parameter of its pipeline."""
    known = {name: value for name, value in dataclasses.asdict(options).items() if value is not None}
    foreign = set(() if is_twin(options) else OF_THE_SIMULATION)
    foreign.update(OF_THE_HARDWARE if recording_of(options) or is_twin(options) else ())
    foreign.update(() if options.policy == "explore" else ("explorer",))
    run = {name: str(value) if isinstance(value, Path) else value for name, value in known.items() if name not in foreign}
    return {"run": run, "parameters": dataclasses.asdict(settings)}


def prepare(folder: Path, config: Mapping[str, Any]) -> None:
    """Make the folder, remove the results of an earlier run in it and write what is needed to repeat this one.

    A recording is left alone: only another one takes its place.

    Raises:
        OutputError: it cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in (*RESULTS, *OF_SOME):
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(folder, error) from error
    write_text(folder / "config.toml", tomli_w.dumps(config))


def write_measurements(folder: Path, record: RunRecord, truth: Truth | None) -> None:
    """Write trajectories and maps: what cannot be had again.

    Raises:
        SlamError: a file cannot be written; the others are whole.
    """
    write_trajectory(folder / "trajectory.tum", record.estimate)
    write_trajectory(folder / "trajectory_final.tum", record.final)
    write_trajectory(folder / "odometry.tum", record.odometry)
    write_map(record.map, folder / "map")
    write_hits(record.map, folder / "map.hits.npz")
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
    if len(record.beliefs.stamps):
        write_particles_png(folder / "particles.png", record)
    write_gif(folder / "run.gif", record)
    write_page(folder / "report.html", record)


def _name_of(recording: Path) -> str:
    if recording.is_dir():
        return recording.name
    return recording.parent.name if recording.name in (RECORDING, UNFINISHED) else recording.stem
