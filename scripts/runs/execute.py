"""From options to a finished run folder."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np

from hardware.errors import HardwareError
from hardware.fault_kinds import Fault
from hardware.faults import befall
from hardware.hal import Robot
from hardware.recorder import Recorder
from hardware.urdf import urdf
from scripts.errors import UsageError
from scripts.runs.body import Truth, is_twin, known_truth, live_truth, make_robot, policy_name, route
from scripts.runs.files import OutputError
from scripts.runs.folder import config_of, prepare, results_folder, write_measurements, write_report
from scripts.runs.interruption import interruptible
from scripts.runs.known_map import GivenMap, read_given_map
from scripts.runs.loop import Loop, RunLog
from scripts.runs.metrics import Timing, compute_metrics
from scripts.runs.options import RunOptions
from scripts.runs.parameters import read_parameters
from scripts.runs.progress import progress_bar
from scripts.runs.record import ParticleHistory, RunRecord
from sim.errors import SimError
from slam.errors import SlamError, UnknownNameError
from slam.evaluation.visibility import View
from slam.landmarks.marker_map_file import write_aruco_map, write_marker_map
from slam.mapping.visual_slam import VisualSlam, VisualSlamPipeline
from slam.messages import Trajectory
from slam.navigation.policies import Policy, make_policy
from slam.pipelines import LOCALIZERS, PIPELINES, Finishing, LocalizerSettings, Pipeline, PipelineSettings, Resumable, warm_up
from slam.se2 import SE2
from worlds.loader import load_world

SIMULATED = 60.0
"""Length of a simulated run when none is given [s]."""
FARTHEST_START = 100.0
"""The map reaches from its origin to the robot; beyond this it would be mostly nothing [m]."""


@dataclass(frozen=True)
class Finished:
    """A run folder, complete."""

    folder: Path
    record: RunRecord
    interrupted: bool


@dataclass(frozen=True)
class _Run:
    """All that takes part in a run, nothing of it open yet."""

    options: RunOptions
    folder: Path
    robot: Robot
    pipeline: Pipeline
    policy: Policy
    duration: float
    """[s]; inf: as long as there is more."""
    given: GivenMap | None = None


def execute(options: RunOptions) -> Finished:
    """Run and write everything. Ctrl-C, or a body that fails, ends the run early; what there is until then is written.

    Raises:
        UsageError, HardwareError, SimError, SlamError, WorldError, OutputError: with one line that says what to do.
    """
    settings = _settings(options)
    run, log, failure, interrupted = _assemble(options, settings), RunLog(), None, False
    prepare(run.folder, config_of(options, settings))
    try:
        with interruptible() as stopped:
            _drive(run, log, stopped)
        interrupted = stopped()
    except (HardwareError, SimError, SlamError) as error:
        if not log.stamps:
            raise
        failure = error
    if failure is not None:
        with suppress(OutputError, SlamError):  # the first failure is the one to tell of
            _write(run, log)
        raise failure
    return Finished(run.folder, _write(run, log), interrupted)


def measure(options: RunOptions, faults: Sequence[Fault] = ()) -> RunRecord:
    """Run with things going wrong, draw nothing and write nothing; the faults draw by the run's seed.

    Raises:
        UsageError, HardwareError, SimError, SlamError, WorldError: with one line that says what to do.
    """
    run, log = _assemble(options, _settings(options), faults), RunLog()
    _drive(run, log, lambda: False)
    return _scored(_gathered(run, log, _truth(run, log)), log)


def start_pose(options: RunOptions) -> SE2 | None:
    """`T_map_base` at the start; None when it is not told.

    Raises:
        UsageError: it is not finite or too far away.
    """
    if options.start is None:
        return None
    x, y, yaw_deg = options.start
    if not (math.hypot(x, y) <= FARTHEST_START and math.isfinite(yaw_deg)):
        raise UsageError(
            f"--start {x:g} {y:g} {yaw_deg:g}: give finite numbers, and a place within {FARTHEST_START:g} m of the map's origin"
        )
    return SE2(x, y, math.radians(yaw_deg))


def _settings(options: RunOptions) -> PipelineSettings | LocalizerSettings:
    classes = LOCALIZERS if options.pipeline in LOCALIZERS else PIPELINES
    if options.pipeline not in classes:
        raise UnknownNameError("pipeline", options.pipeline, sorted([*PIPELINES, *LOCALIZERS]))
    return _with_marker_map(read_parameters(classes[options.pipeline], options.params), options)


def _with_marker_map(settings: PipelineSettings | LocalizerSettings, options: RunOptions) -> PipelineSettings | LocalizerSettings:
    if options.marker_map is None:
        return settings
    if not isinstance(settings, VisualSlam):
        raise UsageError(f"--marker-map: the pipeline '{options.pipeline}' does not look at markers; take --pipeline visual_slam")
    return dataclasses.replace(settings, marker_map=str(options.marker_map))


def _assemble(options: RunOptions, settings: PipelineSettings | LocalizerSettings, faults: Sequence[Fault] = ()) -> _Run:
    start, duration = start_pose(options), _duration(options)
    robot = befall(make_robot(options), tuple(faults), options.seed) if faults else make_robot(options)
    given = _given_map(options)
    build = _builder(settings, given, start)
    T_map_start = start or SE2()
    if given is not None and is_twin(options):
        T_map_start = given.T_world_map.inverse() @ SE2(*load_world(options.world).start)
    policy = make_policy(policy_name(options, robot), route(options, T_map_start))
    pipeline = build()
    if options.session is not None:
        session_of(pipeline, options).resume(options.session)
    warm_up(build())
    return _Run(options, results_folder(options), robot, pipeline, policy, duration, given)


def _builder(settings: PipelineSettings | LocalizerSettings, given: GivenMap | None, start: SE2 | None) -> Callable[[], Pipeline]:
    if given is None:
        return lambda: cast("PipelineSettings", settings).build(start)
    return lambda: cast("LocalizerSettings", settings).build(given.known, start)


def _given_map(options: RunOptions) -> GivenMap | None:
    needed = options.pipeline in LOCALIZERS
    if needed and options.map is None:
        raise UsageError(f"the pipeline '{options.pipeline}' localises in a map: give --map with the folder of a run that made one")
    if not needed and options.map is not None:
        raise UsageError(f"--map: the pipeline '{options.pipeline}' makes its own map; localizers are {', '.join(sorted(LOCALIZERS))}")
    return None if options.map is None else read_given_map(options.map)


def session_of(pipeline: Pipeline, options: RunOptions) -> Resumable:
    """The pipeline, as one that keeps sessions.

    Raises:
        UsageError: it keeps none.
    """
    if not isinstance(pipeline, Resumable):
        raise UsageError(f"--session: the pipeline '{options.pipeline}' keeps no session; take --pipeline lidar_slam")
    return pipeline


def _duration(options: RunOptions) -> float:
    if options.duration is None:
        return SIMULATED if is_twin(options) else math.inf
    if not (math.isfinite(options.duration) and options.duration > 0.0):
        raise UsageError(f"--duration {options.duration:g}: give a positive number of seconds")
    return options.duration


def _drive(run: _Run, log: RunLog, stopped: Callable[[], bool]) -> None:
    """The run itself, what the pipeline does when it is over, and the session that is left."""
    with ExitStack() as stack:
        stack.enter_context(run.robot)
        recorder = stack.enter_context(Recorder(run.robot, run.folder, urdf(run.robot.spec))) if run.options.record else None
        progress = stack.enter_context(progress_bar(run.robot, run.duration))
        true_pose = live_truth(run.options, run.robot)
        Loop(run.robot, run.pipeline, run.policy, stopped, run.duration, recorder, true_pose, progress).run(log)
    began = time.perf_counter()
    if isinstance(run.pipeline, Finishing):
        run.pipeline.finish()
    log.wall_time += time.perf_counter() - began
    if run.options.session is not None:
        session_of(run.pipeline, run.options).save(run.options.session)


def _write(run: _Run, log: RunLog) -> RunRecord:
    """Write the folder: first what cannot be had again, last what is drawn from it."""
    truth = _truth(run, log)
    record = _gathered(run, log, truth)
    write_measurements(run.folder, record, truth)
    _write_markers(run)
    record = _scored(record, log)
    write_report(run.folder, record)
    return record


def _write_markers(run: _Run) -> None:
    """Leave the marker map of a pipeline that has made one, ours and ArUco's."""
    markers = run.pipeline.marker_map() if isinstance(run.pipeline, VisualSlamPipeline) else None
    if markers is not None and markers.markers and run.options.marker_map is None:
        write_marker_map(run.folder / "markers.yaml", markers)
        write_aruco_map(run.folder / "markers_aruco.yml", markers)


def _truth(run: _Run, log: RunLog) -> Truth | None:
    return known_truth(run.options, run.robot, np.array(log.stamps))


def _gathered(run: _Run, log: RunLog, truth: Truth | None) -> RunRecord:
    """All that is known of the run but its metrics."""
    snapshot, lidar = run.pipeline.snapshot(), run.robot.spec.lidar
    return RunRecord(
        title=_title(run.options),
        estimate=_trajectory(log.stamps, log.poses),
        final=snapshot.trajectory,
        odometry=_trajectory(list(log.odometry), list(log.odometry.values())),
        map=snapshot.map,
        truth=truth.trajectory if truth else None,
        walls=truth.walls if truth else None,
        statuses=tuple(log.statuses),
        key_frames=tuple(log.key_frames),
        beliefs=ParticleHistory.of(log.beliefs),
        view=View(lidar.range_max, float(lidar.angles[0]), float(lidar.angles[-1])) if lidar else View(),
        T_base_laser=lidar.T_base_laser.to_se2() if lidar else SE2(),
        T_world_map=run.given.T_world_map if run.given else None,
    )


def _scored(record: RunRecord, log: RunLog) -> RunRecord:
    return dataclasses.replace(record, metrics=compute_metrics(record, Timing(np.array(log.updates), log.wall_time)))


def _title(options: RunOptions) -> str:
    return f"{options.pipeline} in {options.world if is_twin(options) else Path(options.robot).name}"


def _trajectory(stamps: list[float], poses: list[SE2]) -> Trajectory:
    return Trajectory(np.array(stamps), np.array([pose.as_array() for pose in poses]).reshape(-1, 3))
