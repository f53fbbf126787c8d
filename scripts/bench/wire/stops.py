"""Clients that are killed at full speed, on every way to the brick: how long the twin's wheels go on."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from scripts.bench.row import Row
from scripts.bench.wire.stage import ANYWHERE, ROOT, WORLD, emulated
from slam.trajectory_file import read_trajectory

AT_REST = 0.005
"""Slower than this is at rest [m/s]."""
TRIALS = 5
"""On each way to the brick."""
WATCHED = 2.0
"""After the kill [s]."""


def run(smoke: bool) -> list[Row]:
    """The longest time from kill -9 to rest, by transport."""
    trials = 1 if smoke else TRIALS
    with TemporaryDirectory() as folder:
        ways = {"TCP": ANYWHERE, "serial": str(Path(folder) / "brick"), "ev3dev": "ev3dev:127.0.0.1:0"}
        longest = {name: max(time_to_rest(way, Path(folder) / "truth.tum") for _ in range(trials)) for name, way in ways.items()}
    what = f"kill -9 at full speed to wheels at rest, worst of {trials}"
    return [Row("wire", f"{name}: {what}", seconds, "s", "≤ 0.6") for name, seconds in longest.items()]


def time_to_rest(way: str, truth: Path) -> float:
    """From the kill of a client on a way to the brick to the last moment at which the twin moves [s]; its truth goes to a file."""
    with emulated("--ev3", way, "--world", WORLD, "--truth", str(truth)) as devices:
        command = [sys.executable, "-m", "scripts.bench.wire.full_speed", devices.brick]
        client = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE)
        assert client.stdout is not None
        client.stdout.readline()
        killed = time.monotonic()
        client.send_signal(signal.SIGKILL)
        client.communicate()
        time.sleep(WATCHED)
    told = read_trajectory(truth)
    speeds = np.hypot(*np.diff(told.poses[:, :2], axis=0).T) / np.diff(told.stamps)
    return float(max(told.stamps[1:][speeds > AT_REST], default=float("inf")) - killed)
