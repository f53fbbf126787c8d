"""A drive that is recorded once, by the truth, for estimators that are judged on it later."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hardware.recorder import Recorder
from hardware.urdf import urdf
from scripts.runs.body import make_robot, route
from scripts.runs.folder import config_of, prepare
from scripts.runs.interruption import interruptible
from scripts.runs.loop import Loop, RunLog
from scripts.runs.options import RunOptions
from scripts.runs.progress import progress_bar
from sim.ground_truth import ground_truth
from slam.grid import GridGeometry, OccupancyGrid
from slam.mapping.odometry import Odometry
from slam.messages import Estimate, SensorFrame, Trajectory
from slam.navigation.policies import make_policy
from slam.se2 import SE2
from slam.snapshot import Snapshot
from worlds.loader import load_world

NOTHING = Snapshot(OccupancyGrid.empty(GridGeometry(0.05, 1, 1)), Trajectory(np.empty(0), np.empty((0, 3))))


@dataclass(frozen=True)
class Guide:
    """Stands where a pipeline stands and answers with the truth."""

    true_pose: Callable[[float], SE2]

    def update(self, frame: SensorFrame) -> Estimate:
        """`T_world_base` at the frame's time."""
        return Estimate(frame.stamp, self.true_pose(frame.stamp), SE2(), np.zeros((3, 3)))

    def snapshot(self) -> Snapshot:
        """Nothing is mapped."""
        return NOTHING


def record_tour(options: RunOptions, folder: Path, duration: float) -> None:
    """Record the tour of a twin's world, driven by the truth, as the recording of a run; `duration` is in seconds.

    Raises:
        HardwareError, SimError, WorldError, OutputError: with one line that says what to do.
    """
    robot = make_robot(options)
    policy = make_policy("tour", route(options, SE2(*load_world(options.world).start)))
    prepare(folder, config_of(options, Odometry()))
    with robot, Recorder(robot, folder, urdf(robot.spec)) as recorder, interruptible() as stopped:
        true_pose = ground_truth(robot).pose
        with progress_bar(robot, duration) as bar:
            Loop(robot, Guide(true_pose), policy, stopped, duration, recorder, true_pose, bar).run(RunLog())
