"""Real recordings: the URG-04LX of the mission and the Intel lab."""

from __future__ import annotations

import math
import os
import tempfile
from pathlib import Path

from scripts.bench.row import Row
from scripts.errors import UsageError
from scripts.runs.execute import Finished, execute
from scripts.runs.options import RunOptions
from slam.evaluation.relations import read_relations, relation_error


def run(smoke: bool) -> list[Row]:
    """Map both recordings with the default parameters.

    Raises:
        UsageError: the recordings are not there.
    """
    data = Path(os.environ.get("BRICKTWIN_DATA", Path(__file__).parents[3] / "shared" / "data"))
    if not data.is_dir():
        raise UsageError(f"no public recordings at {data}; set BRICKTWIN_DATA to the folder that holds urg04lx/ and intel-lab/")
    return _urg04lx(data / "urg04lx" / "exp1.dat", smoke) + _intel(data / "intel-lab", smoke)


def _urg04lx(path: Path, smoke: bool) -> list[Row]:
    duration = 10.0 if smoke else None
    lidar, odometry = (_replay(path, pipeline, duration) for pipeline in ("lidar", "odometry"))
    cells, floor = (int(run.record.map.occupied().sum()) for run in (lidar, odometry))
    name = f"{path.name}, occupied cells at 5 cm"
    return [
        Row("recordings", name, cells, "", "≤ 0.9 x odometry", "odometry pipeline", floor, floor / cells),
        Row("recordings", f"{path.name}, speed", lidar.record.metrics["real_time_factor"], "x real time", "≥ 20"),
    ]


def _intel(folder: Path, smoke: bool) -> list[Row]:
    lidar = _replay(folder / "intel.log", "lidar", 300.0 if smoke else None).record
    error = relation_error(lidar.final, lidar.odometry, read_relations(folder / "intel.relations"))
    return [
        Row("recordings", "Intel lab, relation error, mean", error.translation_mean, "m", "≤ 0.10"),
        Row("recordings", "Intel lab, relation error, standard deviation", error.translation_std, "m"),
        Row("recordings", "Intel lab, rotation error, mean", math.degrees(error.rotation_mean), "deg"),
        Row("recordings", "Intel lab, speed", lidar.metrics["real_time_factor"], "x real time"),
    ]


def _replay(path: Path, pipeline: str, duration: float | None) -> Finished:
    with tempfile.TemporaryDirectory() as folder:
        return execute(RunOptions(robot=f"replay:{path}", pipeline=pipeline, duration=duration, out=Path(folder)))
