"""From options to a finished run folder."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hardware.errors import HardwareError
from hardware.fault_kinds import Fault
from hardware.recorder import Recorder
from hardware.urdf import urdf
from scripts.runs.assembly import Assembly, assemble, session_of, settings_of
from scripts.runs.body import Truth, is_twin, known_truth, live_truth
from scripts.runs.files import OutputError
from scripts.runs.folder import config_of, prepare, write_measurements, write_report
from scripts.runs.interruption import interruptible
from scripts.runs.loop import Loop, RunLog
from scripts.runs.marker_pictures import write_marker_pictures
from scripts.runs.metrics import Timing, compute_metrics
from scripts.runs.options import RunOptions
from scripts.runs.progress import progress_bar
from scripts.runs.record import ParticleHistory, RunRecord
from sim.errors import SimError
from slam.errors import SlamError
from slam.evaluation.visibility import View
from slam.fusion.pipeline import FusionPipeline
from slam.landmarks.marker_map_file import write_aruco_map, write_marker_map
from slam.mapping.visual_slam import VisualSlamPipeline
from slam.messages import Trajectory
from slam.navigation.outcome import Concluding
from slam.pipelines import Finishing
from slam.se2 import SE2


@dataclass(frozen=True)
class Finished:
    """A run folder, complete."""

    folder: Path
    record: RunRecord
    interrupted: bool


def execute(options: RunOptions) -> Finished:
    """Run and write everything. Ctrl-C, or a body that fails, ends the run early; what there is until then is written.

    Raises:
        UsageError, HardwareError, SimError, SlamError, WorldError, OutputError: with one line that says what to do.
    """
    settings = settings_of(options)
    run, log, failure, interrupted = assemble(options, settings), RunLog(), None, False
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
    run, log = assemble(options, settings_of(options), faults), RunLog()
    _drive(run, log, lambda: False)
    return _scored(_gathered(run, log, _truth(run, log)), log)


def _drive(run: Assembly, log: RunLog, stopped: Callable[[], bool]) -> None:
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


def _write(run: Assembly, log: RunLog) -> RunRecord:
    """Write the folder: first what cannot be had again, last what is drawn from it."""
    truth = _truth(run, log)
    record = _gathered(run, log, truth)
    write_measurements(run.folder, record, truth)
    _write_markers(run, record)
    record = _scored(record, log)
    write_report(run.folder, record)
    return record


def _write_markers(run: Assembly, record: RunRecord) -> None:
    """Leave the marker map of a pipeline that has made one, ours and ArUco's, and pictures of what it went by."""
    markers = run.pipeline.marker_map() if isinstance(run.pipeline, VisualSlamPipeline | FusionPipeline) else None
    if markers is None or not markers.markers:
        return
    views = [moment.markers for moment in record.key_frames if moment.markers is not None]
    if views:
        write_marker_pictures(run.folder, record.title, (markers, record.final), views)
    if run.options.marker_map is None:
        write_marker_map(run.folder / "markers.yaml", markers)
        write_aruco_map(run.folder / "markers_aruco.yml", markers)


def _truth(run: Assembly, log: RunLog) -> Truth | None:
    return known_truth(run.options, run.robot, np.array(log.stamps))


def _gathered(run: Assembly, log: RunLog, truth: Truth | None) -> RunRecord:
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
        outcome=run.policy.outcome if isinstance(run.policy, Concluding) else None,
        true_map=truth.grid if truth and isinstance(run.policy, Concluding) else None,
        collisions=truth.collisions if truth else None,
        robot_radius=run.robot.spec.radius,
    )


def _scored(record: RunRecord, log: RunLog) -> RunRecord:
    return dataclasses.replace(record, metrics=compute_metrics(record, Timing(np.array(log.updates), log.wall_time)))


def _title(options: RunOptions) -> str:
    return f"{options.pipeline} in {options.world if is_twin(options) else Path(options.robot).name}"


def _trajectory(stamps: list[float], poses: list[SE2]) -> Trajectory:
    return Trajectory(np.array(stamps), np.array([pose.as_array() for pose in poses]).reshape(-1, 3))
