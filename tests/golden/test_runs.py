"""Whole runs with default parameters: bounds on what they reach, not digits."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from hardware.hal import Robot
from hardware.replay import Replay
from sim.ground_truth import ground_truth
from sim.robot import Sim
from slam.evaluation.maps import wall_rms
from slam.evaluation.relations import read_relations, relation_error
from slam.evaluation.trajectory import Statistics, absolute_errors, align, interpolate_truth
from slam.messages import Estimate, Status, Trajectory, Twist, WheelOdometry
from slam.navigation.policies import Policy, make_policy
from slam.pipelines import pipeline_settings
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot
from worlds.loader import load_world

PERIOD = 0.04
NO_ROUTE = np.empty((0, 2))


@dataclass
class Run:
    """What a pipeline said on a robot."""

    estimates: list[Estimate] = field(default_factory=list)
    odometry: dict[float, WheelOdometry] = field(default_factory=dict)
    snapshot: Snapshot | None = None

    @property
    def trajectory(self) -> Trajectory:
        return Trajectory([e.stamp for e in self.estimates], [e.T_map_base.as_array() for e in self.estimates])

    @property
    def wheels(self) -> Trajectory:
        return Trajectory(list(self.odometry), [reading.T_odom_base.as_array() for reading in self.odometry.values()])


def run(robot: Robot, name: str, policy: Policy, duration: float = math.inf) -> Run:
    """The HAL's loop."""
    pipeline, result, t = pipeline_settings(name)().build(), Run(), robot.clock.now()
    end = t + duration
    while t < end and robot.clock.sleep_until(t + PERIOD):
        frame = robot.read()
        result.estimates.append(pipeline.update(frame))
        result.odometry.update((reading.stamp, reading) for reading in frame.odometry)
        if frame.scans or result.snapshot is None:
            result.snapshot = pipeline.snapshot()
        command: Twist | None = policy(frame, result.estimates[-1], result.snapshot)
        if command is not None:
            robot.drive(command)
        t = robot.clock.now()
    return result


def replay(recording: Path, name: str) -> Run:
    with Replay(recording).build() as robot:
        return run(robot, name, make_policy("none", NO_ROUTE))


def occupied_cells(result: Run) -> int:
    assert result.snapshot is not None
    return int(result.snapshot.map.occupied().sum())


def test_matching_makes_a_crisper_map_of_a_real_recording_than_odometry(shared_data: Path) -> None:
    recording = shared_data / "urg04lx" / "exp1.dat"
    assert occupied_cells(replay(recording, "lidar")) <= 0.9 * occupied_cells(replay(recording, "odometry"))


def test_the_intel_lab_is_mapped_without_loop_closure(shared_data: Path) -> None:
    folder = shared_data / "intel-lab"
    result = replay(folder / "intel.log", "lidar")
    assert result.snapshot is not None
    error = relation_error(result.snapshot.trajectory, result.wheels, read_relations(folder / "intel.relations"))
    assert error.translation_mean <= 0.05
    assert math.degrees(error.rotation_mean) <= 1.75


@pytest.fixture(scope="module")
def tour() -> tuple[Run, Trajectory, FloatArray]:
    """Twenty seconds in aruco_room, the truth at every estimate, and the true walls."""
    world = load_world("aruco_room")
    route = SE2(*world.start).inverse().transform(np.array(world.tour, dtype=np.float64))
    with Sim(seed=3).build() as robot:
        result = run(robot, "lidar", make_policy("tour", route), 20.0)
        truth = ground_truth(robot)
        return result, truth.trajectory(result.trajectory.stamps), truth.segments()


def test_the_twin_knows_where_it_is(tour: tuple[Run, Trajectory, FloatArray]) -> None:
    result, truth, _ = tour
    paired = interpolate_truth(truth, result.trajectory)
    errors = absolute_errors(*paired, align(*paired))
    assert Statistics.of(errors.translation).rmse <= 0.020
    assert math.degrees(Statistics.of(errors.heading).rmse) <= 0.5


def test_the_twin_knows_its_walls(tour: tuple[Run, Trajectory, FloatArray]) -> None:
    result, truth, walls = tour
    assert result.snapshot is not None
    T_world_map = align(*interpolate_truth(truth, result.snapshot.trajectory))
    assert wall_rms(result.snapshot.map, walls, T_world_map) <= 0.015


def test_the_twin_has_driven_and_was_never_lost(tour: tuple[Run, Trajectory, FloatArray]) -> None:
    result, truth, _ = tour
    assert np.hypot(*np.diff(truth.poses[:, :2], axis=0).T).sum() > 2.0
    assert Status.LOST not in {estimate.status for estimate in result.estimates}
    assert np.mean([estimate.status == Status.TRACKING for estimate in result.estimates]) > 0.95
