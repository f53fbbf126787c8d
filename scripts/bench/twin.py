"""`twin bench twin`: speed, memory and repeatability of the twin."""

from __future__ import annotations

import hashlib
import math
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from scripts.bench.row import Row
from sim.robot import Sim, SimRobot
from slam.messages import SensorFrame, Twist

TICK = 0.05


def run(smoke: bool) -> list[Row]:
    """Rows of the twin with lidar, odometry and gyro in the aruco_room."""
    duration, rounds, resets = (5.0, 1, 20) if smoke else (60.0, 5, 200)
    return [
        Row("twin", "lidar, odometry and gyro, real time", _real_time_factor(duration, rounds), "x", ">= 10"),
        Row("twin", f"memory growth over {resets} resets", _reset_growth_mb(resets), "MB", "<= 10"),
        Row("twin", f"same seed, fresh processes, identical SHA-256 over {duration:g} s", float(_repeats(duration)), "1 = yes", "1"),
    ]


def digest(seed: int, duration: float) -> str:
    """SHA-256 over all readings of a drive."""
    result = hashlib.sha256()
    with Sim(seed=seed).build() as robot:
        for frame in _drive(robot, duration):
            result.update(repr((frame.stamp, frame.odometry, frame.imu)).encode())
            for scan in frame.scans:
                result.update(np.float64(scan.stamp).tobytes() + scan.ranges.tobytes())
    return result.hexdigest()


def _drive(robot: SimRobot, duration: float) -> Iterator[SensorFrame]:
    """Frames of a drive that wanders about the start."""
    for tick in range(round(duration / TICK) + 1):
        robot.clock.sleep_until(tick * TICK)
        yield robot.read()
        robot.drive(Twist(0.15 * math.sin(0.1 * tick), 0.8))


def _real_time_factor(duration: float, rounds: int) -> float:
    factors: list[float] = []
    with Sim().build() as robot:
        for seed in range(rounds + 1):
            robot.reset(seed)
            start = time.perf_counter()
            frames = sum(1 for _ in _drive(robot, duration if seed else 1.0))
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


def _repeats(duration: float) -> bool:
    command = [sys.executable, "-m", "scripts.bench.twin", "1", str(duration)]
    root = Path(__file__).parents[2]
    digests = {subprocess.run(command, capture_output=True, text=True, check=True, cwd=root).stdout.split()[-1] for _ in range(2)}
    return len(digests) == 1


if __name__ == "__main__":
    print(digest(int(sys.argv[1]), float(sys.argv[2])))
