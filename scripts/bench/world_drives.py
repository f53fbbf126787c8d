"""Drives through simulated worlds that know the truth, for figures of estimators."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from sim.ground_truth import ground_truth
from sim.kinematic import Kinematic
from sim.twin import TwinRobot
from slam.evaluation.poses import sample
from slam.messages import LaserScan, SensorFrame, Trajectory, Twist
from slam.navigation.tour import Tour, TourPolicy
from slam.scans import deskew
from slam.se2 import SE2, FloatArray
from worlds.loader import load_world

PERIOD = 0.04
"""Time between control steps [s]."""
SAME = 0.15
"""Two scans see the same point when it is so near to a hit of both, along the beam [m]."""
Command = Callable[[float, SE2], Twist]
"""From a time [s] and the true pose to a command."""
STILL = Trajectory(np.empty(0), np.empty((0, 3)))


@dataclass
class Drive:
    """What the robot said, and where it was."""

    frames: list[SensorFrame] = field(default_factory=list[SensorFrame])
    truth: Trajectory = STILL
    """`T_world_base` at every frame."""
    walls: FloatArray = field(default_factory=lambda: np.empty((0, 4)))
    """(M, 4) true walls at the lidar's height [m]."""

    def pose(self, stamp: float) -> SE2:
        """`T_world_base` at a time [s]."""
        return SE2.from_array(sample(self.truth, np.array([stamp]))[0])

    def scans(self, distance: float) -> list[LaserScan]:
        """Scans so far apart [m], or as many radians."""
        chosen: list[LaserScan] = []
        last: SE2 | None = None
        for scan in (scan for frame in self.frames for scan in frame.scans):
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


def drive(world: str, duration: float, command: Command, seed: int = 1) -> Drive:
    """Drive by what `command` says."""
    with Kinematic(world=world, seed=seed).build() as robot:
        truth, frames = ground_truth(robot), list(_frames(robot, duration, command))
        return Drive(frames, truth.trajectory(np.array([frame.stamp for frame in frames])), truth.segments())


def drive_tour(world: str, duration: float, seed: int = 1) -> Drive:
    """Drive the world's tour, round and round, on the truth."""
    return drive(world, duration, _on_tour(world), seed)


def tour_frames(world: str, duration: float, seed: int = 1) -> Iterator[SensorFrame]:
    """The frames of a tour, one after the other, that need not be kept."""
    with Kinematic(world=world, seed=seed).build() as robot:
        yield from _frames(robot, duration, _on_tour(world))


def _on_tour(world: str) -> Command:
    policy = TourPolicy(Tour(), np.array(load_world(world).tour))
    return lambda _, T_world_base: policy.pursue(T_world_base)


def _frames(robot: TwinRobot, duration: float, command: Command) -> Iterator[SensorFrame]:
    truth = ground_truth(robot)
    while robot.clock.now() < duration:
        robot.clock.sleep_until(robot.clock.now() + PERIOD)
        frame = robot.read()
        yield frame
        robot.drive(command(frame.stamp, truth.pose(frame.stamp)))
