"""Fixtures for all tests."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import settings

# kernels compile on their first call, and a failure must come back on the next run
settings.register_profile("repeatable", deadline=None, derandomize=True, max_examples=60)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of public recordings and maps: beside the checkout or at $BRICKTWIN_DATA."""
    folder = Path(os.environ.get("BRICKTWIN_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no public recordings at {folder}; set BRICKTWIN_DATA")
    return folder


@pytest.fixture(scope="session")
def emulate() -> Iterator[Callable[..., tuple[str, ...]]]:
    """Starts `twin emulate` with options on free ports; returns the addresses of brick and lidar, and of the camera if there is one."""
    running: list[subprocess.Popen[str]] = []

    def start(*options: str) -> tuple[str, ...]:
        command = [sys.executable, "-m", "scripts.cli", "emulate", "--robot", "kinematic", "--ev3", "tcp:127.0.0.1:0"]
        command += ["--lidar", "tcp:127.0.0.1:0", "--delay", "none", *options]
        running.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[1]))
        assert running[-1].stdout is not None
        found = re.findall(r"(?:brick|lidar|camera) at (\S+),", running[-1].stdout.readline())
        assert len(found) >= 2
        return tuple(found)

    yield start
    for process in running:
        process.terminate()
        process.communicate()


class Rollers:
    """What an emulated brick can be built into without any physics: motors that run as they are told, at once."""

    def __init__(self) -> None:
        self.angles = [0.0] * 4
        self.percents = [0] * 4
        self.since = [self.now()] * 4
        self.volts = 7.9
        self.rate_deg = 0.0
        self.jammed = False
        self.plugged = {3: 32}

    def now(self) -> float:
        return time.monotonic()

    def angle_deg(self, output: int) -> float:
        elapsed = self.now() - self.since[output]
        return self.angles[output] + (0.0 if self.jammed else self.percents[output] * 10.07 * elapsed)

    def turn(self, output: int, percent: int) -> None:
        self.angles[output], self.since[output] = self.angle_deg(output), self.now()
        self.percents[output] = percent

    def release(self, output: int) -> None:
        self.turn(output, 0)

    def motors(self) -> tuple[int, ...]:
        return 0, 3

    def sensors(self) -> dict[int, int]:
        return self.plugged

    def sense(self, number: int, mode: int) -> tuple[float, ...]:
        return (self.rate_deg if mode == 1 else 0.0,)

    def battery(self) -> tuple[float, float]:
        return self.volts, 0.2


@pytest.fixture
def rollers() -> Rollers:
    return Rollers()
