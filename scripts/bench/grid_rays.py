"""`twin bench grid_rays`: rays through an occupancy grid, rays against upright solids, and the twin that drives without PyBullet."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable

import numpy as np
from msgspec import structs

from hardware.hal import Backend, Robot
from scripts.bench.parity import level_sweeps, without_movable
from scripts.bench.row import Row, median_time
from sim.ground_truth import ground_truth
from sim.kinematic import Kinematic
from sim.lidar import embree_rays, grid_rays
from sim.robot import Sim
from slam.grid import FREE
from slam.kernels.rays import cast, empty_squares
from slam.messages import Twist
from slam.se2 import FloatArray
from worlds.loader import load_world
from worlds.world import World

GROUP = "grid_rays"
WORLD = "aruco_room"
RESOLUTION, REACH = 0.05, 5.6
DRIVE = ((Twist(0.2, 0.9), 3.0), (Twist(0.2, -0.7), 3.0), (Twist(0.0, 1.5), 2.0), (Twist(-0.15, 0.3), 2.0))
"""Ten seconds."""


def run(smoke: bool) -> list[Row]:
    """Rows of speed and agreement."""
    return [_occupancy_row(2_000 if smoke else 200_000, 3 if smoke else 41), *_solid_rows(3 if smoke else 200), *_twin_rows()]


def _occupancy_row(count: int, repeats: int) -> Row:
    """Rays from uniform poses in the free cells of the true grid."""
    with Kinematic(world=WORLD).build() as robot:
        grid = ground_truth(robot).grid(RESOLUTION)
    rng, free = np.random.default_rng(0), np.argwhere(grid.states() == FREE)
    places = (free[rng.integers(len(free), size=count), ::-1] + rng.random((count, 2))) * RESOLUTION
    rays = np.column_stack([places, rng.uniform(-math.pi, math.pi, count)])
    squares = empty_squares(grid.occupied())
    seconds = _median_cpu_time(lambda: cast(squares, rays, RESOLUTION, REACH), repeats)
    return Row(GROUP, "occupancy grid at 5 cm, rays of 5.6 m, one core", count / seconds / 1e6, "M rays/s", "≥ 8")


def _median_cpu_time(work: Callable[[], object], repeats: int) -> float:
    """Median time that this thread was busy with `work` [s], after one warm-up: others may use the machine too."""
    work()
    times: list[float] = []
    for _ in range(repeats):
        began = time.thread_time()
        work()
        times.append(time.thread_time() - began)
    return statistics.median(times)


def _solid_rows(sweeps: int) -> list[Row]:
    world = without_movable(load_world(WORLD))
    grid, embree = grid_rays(world), embree_rays(world)
    rays = list(level_sweeps(world, sweeps, 0))
    ours, peer = (len(rays) / _median_cpu_time(lambda c=caster: [c.meet(*ray, REACH) for ray in rays], 5) for caster in (grid, embree))
    flat = _differences(structs.replace(world, cylinders=()), sweeps)
    round_too = _differences(world, sweeps)
    return [
        Row(GROUP, "`--rays grid`, 682 beams against upright solids", ours, "sweeps/s", "", "embree", peer, ours / peer),
        Row(GROUP, "`--rays grid` against embree, boxes and planes, largest difference", 1e3 * float(flat.max()), "mm", "≤ 1"),
        Row(GROUP, "`--rays grid` against embree, cylinders too, within 1 mm", 100.0 * float(np.mean(round_too <= 1e-3)), "%", "≥ 99.5"),
    ]


def _differences(world: World, sweeps: int) -> FloatArray:
    """Differences of ranges between both ray casters [m]; what is not met counts as `REACH`."""
    grid, embree = grid_rays(world), embree_rays(world)
    both = [(grid.cast(*ray, REACH), embree.cast(*ray, REACH)) for ray in level_sweeps(world, sweeps, 0)]
    return np.array([np.abs(np.minimum(a, REACH) - np.minimum(b, REACH)) for a, b in both], np.float64)


def _twin_rows() -> list[Row]:
    """How far the two twins are apart after the same commands, and how fast each is."""
    ways = [_way(twin(world="hall", realism="ideal")) for twin in (Kinematic, Sim)]
    apart = ways[0] - ways[1]
    turned = np.abs(np.remainder(apart[:, 2] + math.pi, math.tau) - math.pi)
    seconds = [median_time(lambda t=twin: _way(t()), 3) for twin in (Kinematic, Sim)]
    speeds = [10.0 / value for value in seconds]
    return [
        Row(
            GROUP,
            "kinematic against sim, same commands 10 s, ideal: position",
            1e3 * np.hypot(apart[:, 0], apart[:, 1]).max(),
            "mm",
            "≤ 20",
        ),
        Row(GROUP, "kinematic against sim, same commands 10 s, ideal: heading", math.degrees(turned.max()), "deg", "≤ 1"),
        Row(GROUP, "kinematic, lidar, odometry and gyro, real time", speeds[0], "x", "", "sim", speeds[1], speeds[0] / speeds[1]),
    ]


def _way(backend: Backend) -> FloatArray:
    """True poses (101, 3) of the drive."""
    with backend.build() as robot:
        for twist, duration in DRIVE:
            _obey(robot, twist, duration)
        return ground_truth(robot).trajectory(np.linspace(0.0, 10.0, 101)).poses


def _obey(robot: Robot, twist: Twist, duration: float) -> None:
    for _ in range(round(duration / 0.1)):
        robot.drive(twist)
        robot.clock.sleep_until(round(robot.clock.now() + 0.1, 9))
        robot.read()
