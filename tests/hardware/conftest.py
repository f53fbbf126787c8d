"""A body that reports what a test tells it to: the real replay over readings in memory."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest

from hardware.hal import Command
from hardware.logs.log import Event
from hardware.replay import ReplayRobot
from hardware.spec import LidarSpec, RobotSpec
from slam.messages import Imu, LaserScan, Trajectory, Twist, WheelOdometry
from slam.se2 import SE2


@dataclass(frozen=True)
class MemoryLog:
    """A recording that was never on a disk."""

    readings: Sequence[Event]
    spec: RobotSpec = field(default_factory=RobotSpec)

    @property
    def span(self) -> tuple[float, float]:
        return self.readings[0].arrival, self.readings[-1].arrival

    def events(self) -> Iterator[Event]:
        return iter(self.readings)

    def truth(self) -> Trajectory | None:
        return None

    def description(self) -> str:
        return ""


def drive_about(duration: float, seed: int = 0) -> list[Event]:
    """What the default robot reports at ticks of 20 ms while it turns and looks about."""
    rng, lidar, events, pose = np.random.default_rng(seed), LidarSpec(), [], SE2(0.1, -0.2, 3.0)
    for tick in range(1, round(duration * 50) + 1):
        now = round(0.02 * tick, 9)
        pose = pose @ SE2.exp(rng.normal(size=3) * 0.02)
        wheels = (float(rng.normal()), float(rng.normal()))
        events.append(Event(now, "odometry", WheelOdometry(round(now - 0.001, 9), pose, Twist(*rng.normal(size=2).tolist()), wheels)))
        events.append(Event(now, "imu", Imu(round(now - 0.003, 9), float(rng.normal()))))
        if tick % 5 == 0:
            ranges = np.round(rng.uniform(0.02, 5.6, lidar.beams), 3)
            ranges[:3] = np.inf, -np.inf, np.nan
            stamp = round(now - 0.0967 + tick * 1e-9, 9)
            scan = LaserScan(stamp, ranges, lidar.angles, lidar.time_increment, lidar.range_min, lidar.range_max, lidar.T_base_laser)
            events.append(Event(now, "scans", scan))
        events.append(Event(now, "commands", Command(now, Twist(*rng.normal(size=2).tolist()))))
    return events


@pytest.fixture
def make_body() -> Callable[..., ReplayRobot]:
    """Makes a body from events (default: 3 s of driving about) and a spec."""

    def make(events: Sequence[Event] | None = None, spec: RobotSpec | None = None) -> ReplayRobot:
        return ReplayRobot(MemoryLog(drive_about(3.0) if events is None else events, spec or RobotSpec()))

    return make
