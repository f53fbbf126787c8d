"""A drive that every method of an experiment sees: what a twin said while it followed its tour, or a command, by the truth."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from hardware.registry import backend_class
from hardware.spec import RobotSpec
from scripts.runs.loop import PERIOD
from sim.ground_truth import GroundTruth, ground_truth
from sim.twin import TwinRobot
from slam.evaluation.poses import sample, transform
from slam.messages import LaserScan, SensorFrame, Trajectory, Twist
from slam.navigation.tour import Tour, TourPolicy
from slam.scans import deskew
from slam.se2 import SE2, FloatArray
from worlds.loader import load_world

SAME = 0.15
"""Two scans see the same point when it is so near to a hit of both, along the beam [m]."""
STILL = Trajectory(np.empty(0), np.empty((0, 3)))

Command = Callable[[float, SE2], Twist]
"""From a time [s] and the true pose to a command."""


@dataclass(frozen=True, eq=False)
class Drive:
    """What the sensors said, and the truth."""

    world: str
    frames: tuple[SensorFrame, ...]
    truth: Trajectory
    """`T_world_base` at every frame."""
    walls: FloatArray
    """(M, 4) true walls x0 y0 x1 y1 [m] at the lidar's height, in the world."""

    @property
    def scans(self) -> list[LaserScan]:
        """All scans, in order."""
        return [scan for frame in self.frames for scan in frame.scans]

    @property
    def start(self) -> SE2:
        """`T_world_base` at the first frame."""
        return SE2.from_array(self.truth.poses[0])

    def pose(self, stamp: float) -> SE2:
        """`T_world_base` at a time [s]."""
        return SE2.from_array(sample(self.truth, np.array([stamp]))[0])

    def truth_at_scans(self) -> Trajectory:
        """`T_start_base` at every scan, seen from where the world's tour starts."""
        stamps = np.array([scan.stamp for scan in self.scans])
        return Trajectory(stamps, transform(SE2(*load_world(self.world).start).inverse(), sample(self.truth, stamps)))

    def spaced_scans(self, distance: float) -> list[LaserScan]:
        """Scans so far apart [m], or as many radians."""
        chosen: list[LaserScan] = []
        last: SE2 | None = None
        for scan in self.scans:
            pose = self.pose(scan.stamp)
            step = SE2(9.0) if last is None else last.inverse() @ pose
            if np.hypot(step.x, step.y) >= distance or abs(step.yaw) >= distance:
                chosen.append(scan)
                last = pose
        return chosen

    def shared(self, before: LaserScan, now: LaserScan) -> float:
        """Share of the beams of `now` that hit what `before` sees."""
        points = deskew(now, STILL).points
        T_laser = self.pose(before.stamp) @ before.T_base_laser.to_se2()
        seen = (T_laser.inverse() @ self.pose(now.stamp)).transform(points)
        bearing, distance = np.arctan2(seen[:, 1], seen[:, 0]), np.hypot(seen[:, 0], seen[:, 1])
        ranges = np.where(np.isfinite(before.ranges), before.ranges, 1e3)
        measured = np.interp(bearing, before.angles, ranges, left=1e3, right=1e3)
        return float(np.mean(np.abs(measured - distance) < SAME)) if len(points) else 0.0


def _as_it_is(frame: SensorFrame) -> SensorFrame:
    return frame


@dataclass(frozen=True)
class Course:
    """Where a drive goes and on what."""

    world: str
    duration: float
    """[s]"""
    seed: int = 1
    robot: str = "kinematic"
    realism: str = "datasheet"
    camera: str = "none"
    spec: RobotSpec = field(default_factory=RobotSpec)
    """What the robot is; its camera serves where `camera` says what draws the images."""
    keep: Callable[[SensorFrame], SensorFrame] = _as_it_is
    """What is kept of a frame: images are large."""

    def drive(self, command: Command | None = None) -> Drive:
        """Drive the world's tour, round and round, or by what `command` says.

        Raises:
            SimError, WorldError: with one line that says what to do.
        """
        with self.body() as robot:
            truth = ground_truth(robot)
            frames = tuple(self.follow(robot, truth, command))
            return Drive(self.world, frames, truth.trajectory(np.array([frame.stamp for frame in frames])), truth.segments())

    def frames(self, command: Command | None = None) -> Iterator[SensorFrame]:
        """The frames of such a drive, one after the other, that need not be kept."""
        with self.body() as robot:
            yield from self.follow(robot, ground_truth(robot), command)

    def body(self) -> TwinRobot:
        """The robot that drives.

        Raises:
            SimError, WorldError: with one line that says what to do.
        """
        backend = backend_class(self.robot)(world=self.world, seed=self.seed, realism=self.realism, camera=self.camera, spec=self.spec)
        body = backend.build()
        assert isinstance(body, TwinRobot), f"{self.robot} is no twin"
        return body

    def follow(self, robot: TwinRobot, truth: GroundTruth, command: Command | None = None) -> Iterator[SensorFrame]:
        """Drive a body to the end, frame by frame; see `drive`."""
        command = command or on_tour(self.world)
        while robot.clock.now() < self.duration and robot.clock.sleep_until(robot.clock.now() + PERIOD):
            frame = robot.read()
            yield self.keep(frame)
            robot.drive(command(frame.stamp, truth.pose(frame.stamp)))


def on_tour(world: str) -> Command:
    """Follow the world's tour."""
    policy = TourPolicy(Tour(), np.array(load_world(world).tour, dtype=np.float64))
    return lambda _, T_world_base: policy.pursue(T_world_base)
