"""`twin bench odometry`: the default robot's wheel odometry by UMBmark.

Borenstein, Feng: "Measurement and correction of systematic odometry errors in mobile robots", IEEE Transactions on Robotics and
Automation 12 (1996): a square of 4 m, driven five times clockwise and five times counter-clockwise on the robot's own odometry; what
counts is where it really is at the end, seen from where it believes to be.
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np

from hardware.spec import RobotSpec
from scripts.bench.row import Row
from sim.ground_truth import ground_truth
from sim.robot import Sim
from slam.messages import Twist, WheelOdometry
from slam.se2 import SE2, FloatArray, wrap_angle
from worlds.parts import Wall
from worlds.toml_file import dump_world
from worlds.world import World

SIDE = 4.0
HALL = 12.0
"""Half the side of an empty hall: the default robot strays by metres [m]."""
PERIOD = 0.05
SPEED, YAW_RATE = 0.2, 0.8
CRAWL, CREEP = 0.03, 0.15
"""Speed [m/s] and yaw rate [rad/s] at the end of a leg and of a turn."""
PLACE, HEADING = 0.005, math.radians(1.0)
"""Where a leg [m] and a turn [rad] are done."""


def run(smoke: bool) -> list[Row]:
    """Both centres of gravity, E_max,syst and the random part."""
    runs, side = (1, 0.5) if smoke else (5, SIDE)
    with tempfile.TemporaryDirectory() as folder:
        world = Path(folder) / "hall.toml"
        world.write_text(dump_world(_hall()), encoding="utf-8")
        errors = {sense: np.array([_square(str(world), seed, side, sense) for seed in range(1, runs + 1)]) for sense in (-1, 1)}
    centres = {sense: float(np.hypot(*found.mean(axis=0))) for sense, found in errors.items()}
    spread = max(float(np.hypot(*found.std(axis=0))) for found in errors.values())
    return [
        Row("odometry", f"UMBmark, centre of gravity of {runs} squares of {side:g} m clockwise", centres[-1], "m"),
        Row("odometry", f"UMBmark, centre of gravity of {runs} squares of {side:g} m counter-clockwise", centres[1], "m"),
        Row("odometry", "UMBmark, E_max,syst", max(centres.values()), "m"),
        Row("odometry", "UMBmark, standard deviation of the end, worse sense", spread, "m"),
    ]


def _square(world: str, seed: int, side: float, sense: int) -> FloatArray:
    """True minus believed end (x, y) [m] of one square; `sense` 1 is counter-clockwise."""
    with Sim(world=world, seed=seed, spec=RobotSpec(lidar=None, imu=None)).build() as robot:
        truth = ground_truth(robot)
        start = truth.pose(0.0)

        def step(twist: Twist) -> WheelOdometry:
            robot.drive(twist)
            robot.clock.sleep_until(robot.clock.now() + PERIOD)
            return robot.read().odometry[-1]

        believed = step(Twist())
        for leg in range(4):
            heading = wrap_angle(0.5 * math.pi * sense * leg)
            corner = believed.T_odom_base
            while (left := side - (corner.inverse() @ believed.T_odom_base).x) > PLACE:
                off = wrap_angle(heading - believed.T_odom_base.yaw)
                believed = step(Twist(min(max(left, CRAWL), SPEED), min(max(2.0 * off, -CREEP), CREEP)))
            while abs(off := wrap_angle(heading + 0.5 * math.pi * sense - believed.T_odom_base.yaw)) > HEADING:
                believed = step(Twist(0.0, math.copysign(min(max(2.0 * abs(off), CREEP), YAW_RATE), off)))
        for _ in range(10):
            believed = step(Twist())
        T_start_base = start.inverse() @ truth.pose(believed.stamp)
    return _place(T_start_base) - _place(believed.T_odom_base)


def _place(pose: SE2) -> FloatArray:
    return np.array([pose.x, pose.y])


def _hall() -> World:
    corners = [(-HALL, -HALL), (HALL, -HALL), (HALL, HALL), (-HALL, HALL)]
    walls = tuple(Wall(a, b, 0.1, 1.0) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
    return World(name="hall", walls=walls, start=(0.0, 0.0, 0.0))
