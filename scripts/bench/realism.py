"""`twin bench realism`: whether the simulated lidar errs as documented, and how far a turn smears its scans."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np
from scipy import stats

from hardware.spec import LidarSpec
from scripts.bench.row import Row
from sim.grid_rays import GridRays
from sim.ground_truth import ground_truth
from sim.lidar import Lidar
from sim.lidar_errors import DATASHEET, LidarErrors
from sim.motion import Motion
from sim.realism import Realism
from sim.robot import Sim
from slam.messages import Trajectory, Twist
from slam.motion.dead_reckoning import DeadReckoning
from slam.scans import deskew
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3
from worlds.parts import Wall
from worlds.toml_file import dump_world
from worlds.world import World

GROUP = "realism"
RANGES = (0.1, 0.3, 0.6, 1.0, 1.7, 2.5, 3.6, 5.0)
FRONT = slice(330, 351)
"""Beams within 3.6 deg of straight ahead."""
CLASSES = 12
"""Of equal probability, of the chi-square test."""
HALF = 2.0, 1.5
"""Half the sides of the room [m]."""
QUIET = "datasheet:lidar.range_sigma=0.002,lidar.range_sigma_share=0.001"
"""The robot with its motion errors; range noise would need hundreds of scans to average out."""
ANGLES = np.radians(np.arange(-7.0, 7.0, 0.05))
ENDS = 120
"""Beams at either end of a sweep that are laid on the walls."""


def run(smoke: bool) -> list[Row]:
    """Rows of range noise and smear."""
    worst = min(noise_fit(distance, 5 if smoke else 200) for distance in RANGES)
    before, after = smears(1.2 if smoke else 6.0)
    return [
        Row(GROUP, f"range noise at {len(RANGES)} ranges against its model, least p of chi-square", worst, "", "≥ 0.001"),
        Row(GROUP, "lidar smear at 1 rad/s before deskew", math.degrees(before), "deg", "3.8 ± 0.3"),
        Row(GROUP, "lidar smear at 1 rad/s after deskew", abs(math.degrees(after)), "deg", "≤ 0.2"),
    ]


def noise_fit(distance: float, scans: int) -> float:
    """Chi-square test's p that ranges to a wall straight ahead at a distance [m] have the data sheet's noise."""
    spec, motion = LidarSpec(), Motion(0, SE3())
    motion.append([(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)] * 100)
    x = spec.T_base_laser.t[0] + distance + 0.05
    realism = Realism(LidarErrors(DATASHEET.range_sigma, DATASHEET.range_sigma_share))
    rng = np.random.default_rng(round(100 * distance))
    lidar = Lidar(spec, realism, GridRays([Wall((x, -10.0), (x, 10.0))]), (), rng)
    measured = np.array([lidar.scan(motion, 0.0).ranges[FRONT] for _ in range(scans)])
    measured += rng.uniform(-0.0005, 0.0005, measured.shape)  # whole millimetres made smooth again
    true = distance / np.cos(spec.angles[FRONT])
    z = (measured - true) / np.maximum(DATASHEET.range_sigma, DATASHEET.range_sigma_share * true)
    classes = np.minimum((CLASSES * stats.norm.cdf(z.ravel())).astype(np.int64), CLASSES - 1)
    return float(stats.chisquare(np.bincount(classes, minlength=CLASSES)).pvalue)


def smears(duration: float) -> tuple[float, float]:
    """Mean angle [rad] by which the last beams of a sweep at 1 rad/s are out of line with the first, as measured and deskewed."""
    before: list[float] = []
    after: list[float] = []
    motion, standing = DeadReckoning(), Trajectory(np.empty(0), np.empty((0, 3)))
    with tempfile.TemporaryDirectory() as folder:
        world = Path(folder) / "room.toml"
        world.write_text(dump_world(_room()), encoding="utf-8")
        with Sim(world=str(world), realism=QUIET).build() as robot:
            truth = ground_truth(robot)
            while robot.clock.now() < duration:
                robot.drive(Twist(0.0, 1.0))
                robot.clock.sleep_until(robot.clock.now() + 0.1)
                frame = robot.read()
                motion.add(frame.odometry, frame.imu)
                for scan in frame.scans:
                    if scan.stamp > 0.8:
                        pose = truth.pose(scan.stamp)
                        before.append(_smear(deskew(scan, standing).points, pose))
                        after.append(_smear(deskew(scan, motion.window(scan.stamp)).points, pose))
    return float(np.mean(before)), float(np.mean(after))


def _smear(points: FloatArray, T_world_base: SE2) -> float:
    """Angle by which the last points (N, 2) of a sweep are out of line with the first ones [rad], for the whole sweep."""
    first, last = (_turned(part, T_world_base) for part in (points[:ENDS], points[-ENDS:]))
    return (last - first) * len(points) / (len(points) - ENDS)


def _turned(points: FloatArray, T_world_base: SE2) -> float:
    """By what angle about the robot points in base are to be turned to lie on the walls [rad]."""
    misfits = [_misfit((T_world_base @ SE2(0.0, 0.0, angle)).transform(points)) for angle in ANGLES.tolist()]
    return float(ANGLES[int(np.argmin(misfits))])


def _misfit(points: FloatArray) -> float:
    """Median distance of points (M, 2) to the walls of the room [m]."""
    return float(np.median(np.abs(np.abs(points) - HALF).min(axis=1)))


def _room() -> World:
    x, y = HALF[0] + 0.05, HALF[1] + 0.05
    corners = [(-x, -y), (x, -y), (x, y), (-x, y)]
    walls = tuple(Wall(a, b, 0.1, 1.0) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
    return World(name="room", walls=walls, start=(0.0, 0.0, 0.0))
