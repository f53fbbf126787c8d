"""`twin bench twin`: speed, memory and repeatability of the twin."""

from __future__ import annotations

import hashlib
import json
import math
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from hardware.camera_spec import d435
from hardware.spec import RobotSpec
from scripts.bench.row import Row
from sim.kinematic import Kinematic
from sim.robot import Sim
from sim.twin import TwinRobot
from slam.messages import SensorFrame, Twist

TICK = 0.05
ALL_SENSORS = RobotSpec(camera=d435((424, 240), (424, 240)))
"""With a small picture: what repeats is the same program at any size."""
WITHOUT: dict[str, tuple[type[Sim] | type[Kinematic], RobotSpec]] = {
    "images": (Sim, replace(ALL_SENSORS, camera=None)),
    "imu": (Kinematic, replace(ALL_SENSORS, imu=None)),
    "scans": (Kinematic, replace(ALL_SENSORS, lidar=None)),
}
"""Sensor -> a twin, and its robot without it. A lidar or a gyro that is taken off `sim` takes its weight along; `kinematic` has none."""


def run(smoke: bool) -> list[Row]:
    """Rows of the twin in the aruco_room: 500 Hz physics, lidar 10 Hz, gyro 100 Hz, odometry 50 Hz, and with RGB-D 15 Hz."""
    duration, rounds, resets = (3.0, 1, 20) if smoke else (60.0, 5, 200)
    return [
        Row("twin", "lidar, gyro and odometry, 500 Hz physics, real time", _real_time_factor(Sim(), duration, rounds), "x", "≥ 15"),
        Row(
            "twin",
            "the same with RGB-D 848 x 480 at 15 Hz, two threads, real time",
            _real_time_factor(Sim(camera="raster"), duration / 3.0, min(rounds, 3)),
            "x",
            "≥ 1.5",
        ),
        Row("twin", f"memory growth over {resets} resets", _reset_growth_mb(resets), "MB", "≤ 10"),
        *_repetition_rows(duration),
    ]


def digests(robot: TwinRobot, duration: float) -> dict[str, str]:
    """SHA-256 of each sensor's readings, and of when they came, on a drive from time zero on."""
    results = {name: hashlib.sha256() for name in ("odometry", "imu", "scans", "images")}
    for frame in drive(robot, duration):
        results["odometry"].update(repr((frame.stamp, frame.odometry)).encode())
        results["imu"].update(repr((frame.stamp, frame.imu)).encode())
        for scan in frame.scans:
            results["scans"].update(np.array([frame.stamp, scan.stamp, *scan.ranges]).tobytes())
        for image in frame.images:
            results["images"].update(np.array([frame.stamp, image.stamp]).tobytes() + image.colour.tobytes() + image.depth.tobytes())
    return {name: result.hexdigest() for name, result in results.items()}


def drive(robot: TwinRobot, duration: float) -> Iterator[SensorFrame]:
    """Frames of a drive that wanders about the start."""
    for tick in range(round(duration / TICK) + 1):
        robot.clock.sleep_until(tick * TICK)
        yield robot.read()
        robot.drive(Twist(0.15 * math.sin(0.1 * tick), 0.8))


def fresh_digests(seed: int, duration: float) -> dict[str, str]:
    """The digests of a robot with all sensors in a process of its own."""
    command = [sys.executable, "-m", "scripts.bench.twin", str(seed), str(duration)]
    process = subprocess.run(command, capture_output=True, text=True, check=True, cwd=Path(__file__).parents[2])
    return json.loads(process.stdout.splitlines()[-1])


def twin(backend: type[Sim] | type[Kinematic], spec: RobotSpec, seed: int) -> TwinRobot:
    """A twin with the sensors of a spec."""
    return backend(camera="none" if spec.camera is None else "raster", spec=spec, seed=seed).build()


def unmoved(sensor: str, seed: int, duration: float) -> bool:
    """Whether the other sensors' readings are the same bits where one sensor is off."""
    backend, spec = WITHOUT[sensor]
    found: list[dict[str, str]] = []
    for sensors in (ALL_SENSORS, spec):
        with twin(backend, sensors, seed) as robot:
            found.append(digests(robot, duration))
    return all((found[0][name] == found[1][name]) == (name != sensor) for name in found[0])


def _repetition_rows(duration: float) -> list[Row]:
    with twin(Sim, ALL_SENSORS, 1) as robot:
        first = digests(robot, duration)
        robot.reset(2)
        robot.clock.sleep_until(1.0)
        robot.reset(1)
        again = digests(robot, duration)
    what = f"SHA-256 over {duration:g} s, all sensors"
    return [
        Row("twin", f"{what}: fresh processes alike", float(first == fresh_digests(1, duration)), "1 = yes", "1"),
        Row("twin", f"{what}: the same after a reset", float(first == again), "1 = yes", "1"),
        *(Row("twin", f"{what}: without {name} the others alike", float(unmoved(name, 1, duration)), "1 = yes", "1") for name in WITHOUT),
    ]


def _real_time_factor(parameters: Sim, duration: float, rounds: int) -> float:
    factors: list[float] = []
    with parameters.build() as robot:
        for seed in range(rounds + 1):
            robot.reset(seed)
            start = time.perf_counter()
            frames = sum(1 for _ in drive(robot, duration if seed else 1.0))
            assert frames
            factors.append(duration / (time.perf_counter() - start))
    return float(np.median(factors[1:]))


def _reset_growth_mb(resets: int) -> float:
    with Sim().build() as robot:
        before = _resident_mb()
        for seed in range(resets):
            robot.reset(seed)
            robot.clock.sleep_until(0.2)
        return _resident_mb() - before


def _resident_mb() -> float:
    return int(Path("/proc/self/status").read_text().split("VmRSS:")[1].split()[0]) / 1024.0


if __name__ == "__main__":
    with twin(Sim, ALL_SENSORS, int(sys.argv[1])) as fresh:
        print(json.dumps(digests(fresh, float(sys.argv[2]))))
