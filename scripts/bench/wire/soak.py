"""A long drive through the wire: what gets lost, how regular it is, what it costs."""

from __future__ import annotations

import resource
import threading
import time

import numpy as np

from hardware.ev3_robot import Ev3, Ev3Robot
from hardware.spec import DriveSpec, LidarSpec
from scripts.bench.row import Row
from scripts.bench.wire import SMOKE
from scripts.bench.wire.stage import WORLD, emulated
from slam.messages import Twist

LASTS = 1800.0
"""[s]"""
PERIOD = 1.0 / 30.0
"""Between two commands [s]."""
CIRCLE = Twist(0.1, 0.5)
WARM = 1.0 / 3.0
"""Share of the time after which memory must not grow any more."""
MIB = 1024.0
"""In the units of ru_maxrss, which on Linux are kB."""


def run(smoke: bool) -> list[Row]:
    """Of a drive of half an hour, the devices in a process of their own."""
    seconds = SMOKE if smoke else LASTS
    with emulated("--world", WORLD) as devices, Ev3(ev3=devices.brick, lidar=devices.lidar).build() as robot:
        scans, messages, memory = _driven(robot, seconds)
        share = sum(_cpu_times()) / seconds
    gaps = np.diff(scans)
    lidar, drive = robot.spec.lidar or LidarSpec(), robot.spec.drive or DriveSpec()
    jitter = np.abs(np.diff(messages) - drive.period)
    what = f"{seconds / 60.0:.3g} min through the wire"
    return [
        Row("wire", f"{what}: scans lost of {len(scans)}", float(np.sum(np.round(gaps / lidar.period) - 1.0)), "", "0"),
        Row("wire", f"{what}: growth of memory after the first third", memory, "MiB", "≤ 2"),
        Row(
            "wire",
            f"{what}: drive messages off their {1e3 * drive.period:.0f} ms, p99",
            1e3 * float(np.percentile(jitter, 99)),
            "ms",
            "≤ 15",
        ),
        Row("wire", f"{what}: CPU of both drivers' threads", 1e2 * share, "% of a core", "≤ 25"),
    ]


def _driven(robot: Ev3Robot, seconds: float) -> tuple[list[float], list[float], float]:
    """Stamps of the scans, stamps of the brick's messages [s], and by how much memory grew at last [MiB]."""
    scans: list[float] = []
    messages: list[float] = []
    start, warm = time.monotonic(), None
    while (gone := robot.clock.now() - start) < seconds:
        frame = robot.read()
        robot.drive(CIRCLE)
        scans += [scan.stamp for scan in frame.scans]
        messages += [reading.stamp for reading in frame.odometry]
        if warm is None and gone > WARM * seconds:
            warm = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        robot.clock.sleep_until(robot.clock.now() + PERIOD)
    return scans, messages, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - (warm or 0)) / MIB


def _cpu_times() -> list[float]:
    """CPU time of the devices' threads so far [s]."""
    threads = [thread for thread in threading.enumerate() if thread.name.startswith(("EV3 at", "lidar at")) and thread.ident is not None]
    return [time.clock_gettime(time.pthread_getcpuclockid(thread.ident)) for thread in threads if thread.ident is not None]
