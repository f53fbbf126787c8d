"""From what is to be compared to one finished run each."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from hardware.logs.registry import open_log
from scripts.compare import CompareOptions
from scripts.comparison.guided import record_tour
from scripts.errors import UsageError
from scripts.runs.execute import execute
from scripts.runs.known_map import GivenMap, read_given_map
from scripts.runs.options import RunOptions
from scripts.runs.record import RunRecord
from slam.errors import UnknownNameError
from slam.evaluation.poses import sample
from slam.pipelines import LOCALIZERS, PIPELINES
from slam.se2 import SE2

Records = dict[str, RunRecord]
"""Pipeline -> its run."""


def run_all(options: CompareOptions) -> Records:
    """Map, drive and record what is not there yet, then run every pipeline on the recording, each into its own folder.

    Raises:
        UsageError, HardwareError, SimError, SlamError, WorldError, OutputError: with one line that says what to do.
    """
    for name in options.pipelines:
        if name not in PIPELINES and name not in LOCALIZERS:
            raise UnknownNameError("pipeline", name, sorted([*PIPELINES, *LOCALIZERS]))
    recording, place = options.recording or options.out / "drive", options.map
    localizers = [name for name in options.pipelines if name in LOCALIZERS]
    if localizers and place is None and options.recording is not None:
        raise UsageError(f"{', '.join(localizers)}: localised in a map; give --map with the folder of a run that made one")
    drive = RunOptions(
        robot=options.robot,
        world=options.world,
        duration=options.duration,
        seed=options.seed,
        realism=options.realism,
        camera=options.camera,
        spec=options.spec,
        record=True,
    )
    if localizers and place is None:
        place = options.out / "map"
        execute(replace(drive, pipeline="lidar_slam", seed=options.seed + 1, camera="none", record=False, out=place))
    if options.recording is None:
        record_tour(drive, recording, options.duration)
    given = read_given_map(place) if localizers and place is not None else None
    start = None if given is None or options.find else _start(recording, given)
    return {name: _run(name, options, recording, place, start) for name in options.pipelines}


def _run(name: str, options: CompareOptions, recording: Path, place: Path | None, start: tuple[float, float, float] | None) -> RunRecord:
    known = {"map": place, "start": start} if name in LOCALIZERS else {}
    told = options.spec if options.recording is not None else None  # a drive of ours says itself what its robot is
    return execute(RunOptions(robot=f"replay:{recording}", pipeline=name, spec=told, out=options.out / name, **known)).record


def _start(recording: Path, given: GivenMap) -> tuple[float, float, float] | None:
    """The true pose in the map at the beginning, x, y [m], yaw [deg], where the recording knows it."""
    truth = open_log(recording).truth()
    if truth is None:
        return None
    T_map_base = given.T_world_map.inverse() @ SE2.from_array(sample(truth, np.array([truth.stamps[0]]))[0])
    return T_map_base.x, T_map_base.y, math.degrees(T_map_base.yaw)
