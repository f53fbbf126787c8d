"""A drive that every method of an experiment sees: frames from a twin that follows its tour by the truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hardware.registry import backend_class
from scripts.runs.loop import PERIOD
from sim.ground_truth import ground_truth
from slam.messages import Estimate, LaserScan, SensorFrame, Trajectory
from slam.navigation.policies import make_policy
from slam.se2 import SE2, FloatArray
from worlds.loader import load_world


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """What the sensors said, and the truth, seen from where the robot started."""

    world: str
    frames: tuple[SensorFrame, ...]
    truth: Trajectory
    """`T_start_base` at every scan."""
    walls: FloatArray
    """(N, 4) true walls x0 y0 x1 y1 [m] in the world."""

    @property
    def scans(self) -> list[LaserScan]:
        """All scans, in order."""
        return [scan for frame in self.frames for scan in frame.scans]


def drive(world: str, seed: int, duration: float, realism: str = "datasheet", robot: str = "sim") -> Drive:
    """Follow the world's tour for `duration` [s].

    Raises:
        SimError, WorldError: with one line that says what to do.
    """
    place = load_world(world)
    T_start_world = SE2(*place.start).inverse()
    policy = make_policy("tour", T_start_world.transform(np.array(place.tour, dtype=np.float64).reshape(-1, 2)))
    frames: list[SensorFrame] = []
    with backend_class(robot)(world=world, seed=seed, realism=realism).build() as body:
        known = ground_truth(body)
        while body.clock.now() < duration and body.clock.sleep_until(body.clock.now() + PERIOD):
            frame = body.read()
            frames.append(frame)
            here = T_start_world @ known.pose(frame.stamp)
            command = policy(frame, Estimate(frame.stamp, here, SE2(), np.zeros((3, 3))), None)
            if command is not None:
                body.drive(command)
        stamps = [scan.stamp for frame in frames for scan in frame.scans]
        poses = [(T_start_world @ known.pose(stamp)).as_array() for stamp in stamps]
        return Drive(world, tuple(frames), Trajectory(np.array(stamps), np.array(poses).reshape(-1, 3)), known.segments())
