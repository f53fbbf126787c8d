"""`twin bench rays`: the simulated lidar, its ray casters, and how well they agree."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from scripts.bench.parity import flat_parity, level_sweeps, physics_of, round_parity
from scripts.bench.row import Row
from sim.bullet import pybullet
from sim.lidar import Lidar, static_rays
from sim.moving import living_bodies, moving_bodies
from sim.rays import EmbreeRays
from sim.realism import REALISMS
from sim.robot import Sim
from sim.scene import static_triangles
from sim.twin import TwinRobot
from slam.messages import Twist
from worlds.loader import load_world

PEER = "pybullet rayTestBatch alone"
CROWD = "office:people=5"


def run(smoke: bool) -> list[Row]:
    """Rows of speed and parity in the aruco_room."""
    return [*_speed_rows(5 if smoke else 25), *_parity_rows(10 if smoke else 200)]


def _speed_rows(rounds: int) -> list[Row]:
    """Medians over rounds in which every contender has its turn."""
    with Sim().build() as robot, Sim(world=CROWD).build() as crowd, physics_of(load_world("aruco_room")) as client:
        for body in (robot, crowd):
            body.drive(Twist(0.2, 1.0))
            body.clock.sleep_until(0.4)
        simulation, spec = robot.running, robot.spec.lidar
        assert spec is not None
        fixed = EmbreeRays(static_triangles(simulation.world))
        lidar, among_people = _lidar(robot), _lidar(crowd)
        origins, directions = next(level_sweeps(simulation.world, 1, 0))
        starts, ends = origins.tolist(), (origins + spec.range_max * directions).tolist()
        contenders: list[tuple[Callable[[], object], int]] = [
            (lambda: lidar.scan(simulation.motion, 0.3), 100),
            (lambda: among_people.scan(crowd.running.motion, 0.3), 100),
            (lambda: fixed.cast(origins, directions, spec.range_max), 100),
            (lambda: pybullet.rayTestBatch(starts, ends, physicsClientId=client), 10),
        ]
        scans, crowded, embree, peer = _rates(contenders, rounds)
    rays = spec.beams
    return [
        Row(
            "rays",
            "simulated lidar, 682 beams with distortion and noise",
            scans,
            "scans/s",
            "≥ 5000; ratio ≥ 8",
            PEER,
            peer,
            scans / peer,
        ),
        Row("rays", f"the same in {CROWD}", crowded, "scans/s", "≥ 3000", PEER, peer, crowded / peer),
        Row("rays", "embree alone", embree * rays, "rays/s", "", PEER, peer * rays, embree / peer),
    ]


def _lidar(robot: TwinRobot) -> Lidar:
    """A lidar in the robot's world, apart from the one that its twin uses."""
    simulation = robot.running
    assert simulation.spec.lidar is not None
    bodies = [*moving_bodies(simulation.world), *living_bodies(simulation.living, simulation.spec.lidar)]
    rays, through_glass = static_rays(simulation.world)
    return Lidar(simulation.spec.lidar, REALISMS["datasheet"], rays, bodies, np.random.default_rng(0), through_glass)


def _rates(contenders: list[tuple[Callable[[], object], int]], rounds: int) -> list[float]:
    """Calls a second of each contender, median over rounds, after one call to warm up."""
    for call, _ in contenders:
        call()
    seconds = [[_seconds(call, repeats) / repeats for call, repeats in contenders] for _ in range(rounds)]
    return [1.0 / float(value) for value in np.median(seconds, axis=0)]


def _seconds(call: Callable[[], object], repeats: int) -> float:
    start = time.thread_time()  # others may use the machine too
    for _ in range(repeats):
        call()
    return time.thread_time() - start


def _parity_rows(sweeps: int) -> list[Row]:
    world = load_world("aruco_room")
    flat, curved = flat_parity(world, sweeps), round_parity(world, sweeps)
    return [
        Row("rays", "parity on boxes and planes, within 1 mm", 100.0 * flat.share_within(0.001), "%", "≥ 99.5"),
        Row("rays", "parity on boxes and planes, the rest within one beam of an edge", 100.0 * flat.rest_beside_edges(0.001), "%", "100"),
        Row("rays", "parity on cylinders, within 5 mm", 100.0 * curved.share_within(0.005), "%", "≥ 99"),
        Row("rays", "parity on cylinders, the rest within one beam of an edge", 100.0 * curved.rest_beside_edges(0.005), "%", "100"),
    ]
