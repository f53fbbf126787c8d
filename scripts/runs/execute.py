"""From options to a finished run folder."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hardware.hal import Robot
from hardware.recorder import Recorder
from hardware.urdf import urdf
from scripts.errors import UsageError
from scripts.runs.body import Truth, known_truth, make_robot, policy_name, route
from scripts.runs.folder import prepare, write_results
from scripts.runs.loop import Loop, RunLog
from scripts.runs.metrics import Timing, compute_metrics
from scripts.runs.options import RunOptions
from scripts.runs.parameters import as_tree, read_parameters
from scripts.runs.progress import progress_bar
from scripts.runs.record import RunRecord
from slam.evaluation.visibility import View
from slam.messages import Trajectory
from slam.navigation.policies import make_policy
from slam.pipelines import Pipeline, pipeline_settings
from slam.se2 import SE2

SIMULATED = 60.0
"""Length of a simulated run when none is given [s]."""


@dataclass(frozen=True)
class Finished:
    """A run folder, complete."""

    folder: Path
    record: RunRecord
    interrupted: bool


def execute(options: RunOptions) -> Finished:
    """Run and write everything; Ctrl-C ends the run early and keeps what there is.

    Raises:
        UsageError, HardwareError, SimError, SlamError, WorldError, OutputError: with one line that says what to do.
    """
    settings = read_parameters(pipeline_settings(options.pipeline), options.params)
    robot = make_robot(options)
    policy = make_policy(policy_name(options, robot), route(options, start_pose(options)))
    pipeline = settings.build(start_pose(options))
    folder = options.out or default_folder(options)
    prepare(folder, {"run": _as_text(options), "parameters": as_tree(settings)})
    duration = _duration(options)
    with ExitStack() as stack:
        stack.enter_context(robot)
        recorder = stack.enter_context(Recorder(robot, folder, urdf(robot.spec))) if options.record else None
        progress = stack.enter_context(progress_bar(robot, duration))
        log = Loop(robot, pipeline, policy, duration, recorder, _true_pose(options, robot), progress).run()
    truth = known_truth(options, robot, np.array(log.stamps))
    record = _record(options, robot, pipeline, log, truth)
    write_results(folder, record, truth)
    return Finished(folder, record, log.interrupted)


def start_pose(options: RunOptions) -> SE2:
    """`T_map_base` at the start."""
    if options.start is None:
        return SE2()
    x, y, yaw_deg = options.start
    if not np.isfinite(options.start).all():
        raise UsageError(f"--start {x} {y} {yaw_deg}: every number must be finite")
    return SE2(x, y, np.radians(yaw_deg))


def default_folder(options: RunOptions) -> Path:
    """`runs/BODY-PIPELINE`, where BODY is the world or the name of the recording."""
    name, _, path = options.robot.partition(":")
    body = Path(path).stem if name == "replay" else Path(options.world.split(":")[0]).stem
    return Path("runs") / f"{body}-{options.pipeline}"


def _duration(options: RunOptions) -> float | None:
    if options.duration is None:
        return SIMULATED if options.robot == "sim" else None
    if not (np.isfinite(options.duration) and options.duration > 0.0):
        raise UsageError(f"--duration {options.duration}: give a positive number of seconds")
    return options.duration


def _true_pose(options: RunOptions, robot: Robot) -> Callable[[float], SE2] | None:
    if options.robot != "sim":
        return None
    from sim.ground_truth import ground_truth

    return ground_truth(robot).pose


def _record(options: RunOptions, robot: Robot, pipeline: Pipeline, log: RunLog, truth: Truth | None) -> RunRecord:
    snapshot, lidar = pipeline.snapshot(), robot.spec.lidar
    record = RunRecord(
        title=f"{options.pipeline} in {options.world if options.robot == 'sim' else Path(options.robot).name}",
        estimate=_trajectory(log.stamps, log.poses),
        final=snapshot.trajectory,
        odometry=_trajectory(list(log.odometry), list(log.odometry.values())),
        map=snapshot.map,
        truth=truth.trajectory if truth else None,
        walls=truth.walls if truth else None,
        statuses=tuple(log.statuses),
        key_frames=tuple(log.key_frames),
        view=View(lidar.range_max, float(lidar.angles[0]), float(lidar.angles[-1])) if lidar else View(),
        T_base_laser=lidar.T_base_laser.to_se2() if lidar else SE2(),
    )
    return dataclasses.replace(record, metrics=compute_metrics(record, Timing(np.array(log.updates), log.wall_time)))


def _trajectory(stamps: list[float], poses: list[SE2]) -> Trajectory:
    return Trajectory(np.array(stamps), np.array([pose.as_array() for pose in poses]).reshape(-1, 3))


def _as_text(options: RunOptions) -> dict[str, object]:
    fields = dataclasses.asdict(options)
    return {key: str(value) if isinstance(value, Path) else value for key, value in fields.items()}
