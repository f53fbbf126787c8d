"""`twin experiment kidnap`: robots that are carried away, of which their own sensors say nothing, and robots that are not."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from rich.console import Console
from rich.table import Table
from tyro.conf import arg

from scripts.bench.lookalikes import Lookalikes
from scripts.errors import UsageError
from scripts.experiments.arena import errors_in, follow, mapped, start_in
from scripts.experiments.drive import Course, Drive
from scripts.experiments.false_alarms import Alarms, alarms_of
from scripts.options import parse
from scripts.runs.known_map import GivenMap
from slam.localization.amcl import Amcl
from slam.messages import Imu, LaserScan, SensorFrame, Trajectory, WheelOdometry
from slam.se2 import SE2

TOUR, MAPPING_SEED = 190.0, 100
"""Length of the drives for the map and for the trials [s], and the seed of the former."""
BEFORE, AFTER = 6.0, 5.0
"""Driving before and after a kidnapping [s]: before, so that the robot is sure of where it is."""
CARRIED = 1.0
"""Least distance that a robot is carried away [m]."""
BACK = 0.3
"""Error below which it has found back [m]."""
TRIES = 100
"""Draws of two places for each trial."""
PERIOD = 0.1
"""From one frame to the next across the jump [s]."""


@dataclass(frozen=True)
class KidnapOptions:
    """Carry the robot of `amcl` to other places of its tour that look like no other, and count how often it finds back within 5 s; then
    let it drive among people, never carried away, and count how often it thinks so.
    """

    worlds: Annotated[tuple[str, ...], arg(metavar="NAME...")] = ("office", "apartment")
    """Where; each is mapped in a drive of its own."""
    trials: Annotated[int, arg(metavar="N")] = 200
    """How often it is carried away, in all worlds together."""
    driving: Annotated[float, arg(metavar="S")] = 3600.0
    """Time of normal driving, in all worlds together [s]; 0 leaves it out."""
    people: Annotated[int, arg(metavar="N")] = 3
    """How many walk about meanwhile."""
    seed: int = 11
    """Of the drives and of the trials."""

    def check(self) -> None:
        """Raise UsageError where an option makes no sense."""
        if not self.worlds:
            raise UsageError("--worlds: name one or more")
        if self.trials < 0 or self.people < 0 or self.seed < 0:
            raise UsageError("--trials, --people, --seed: 0 or above")
        if not (math.isfinite(self.driving) and self.driving >= 0.0):
            raise UsageError(f"--driving {self.driving:g}: give 0 or more seconds")


def main(argv: list[str]) -> int:
    """Map, drive, carry away, print; returns the exit code.

    Raises:
        UsageError, SimError, WorldError: with one line that says what to do.
    """
    options = parse(KidnapOptions, argv, "experiment kidnap")
    options.check()
    began = time.process_time()
    table = Table(
        "world", "carried away", "back within 0.3 m", "time to be back, median (worst)", "not back", "driven", "false alarms", "worst error"
    )
    shares = np.full(len(options.worlds), options.trials // len(options.worlds))
    shares[: options.trials % len(options.worlds)] += 1
    for world, trials in zip(options.worlds, shares.tolist(), strict=True):
        given = mapped(world, TOUR, MAPPING_SEED)
        back = kidnappings(given, world, trials, options.seed) if trials else {}
        alarms = alarms_of(given, world, options.driving / len(options.worlds), options.people, options.seed)
        table.add_row(world, *_cells(back, alarms))
    console = Console(width=170)
    console.print(table)
    console.print(f"{time.process_time() - began:.0f} s of processor time")
    return 0


def kidnappings(given: GivenMap, world: str, count: int, seed: int) -> dict[tuple[float, float], float]:
    """Times [s] from which on a robot is back, inf where it is not, by when and whence on its tour it was carried away."""
    drive, look, rng = Course(world, TOUR, seed).drive(), Lookalikes(world), np.random.default_rng(seed)
    back: dict[tuple[float, float], float] = {}
    for _ in range(TRIES * count):
        until, since = rng.uniform(BEFORE + 1.0, drive.frames[-1].stamp - AFTER - 1.0, 2).round(2).tolist()
        here, there = drive.pose(until), drive.pose(since)
        if math.hypot(here.x - there.x, here.y - there.y) >= CARRIED and look.elsewhere(there) is None:
            back[until, since] = _time_to_return(given, drive, until, since)
        if len(back) == count:
            return back
    raise UsageError(f"--worlds {world}: its tour has too few places that look like no other to carry a robot to")


def _time_to_return(given: GivenMap, drive: Drive, until: float, since: float) -> float:
    """Time [s] after which the error stays below 0.3 m; inf when it does not at the end."""
    course = kidnapped(drive, until, since, AFTER, until - BEFORE)
    outcome = follow(Amcl().build(given.known, start_in(given, course)), course)
    errors = errors_in(given, course, outcome.estimate)
    if errors.position[-1] >= BACK:
        return math.inf
    far = errors.stamps[errors.position >= BACK]
    return max(float(far[-1]) - until, 0.0) if len(far) else 0.0


def _cells(back: dict[tuple[float, float], float], alarms: Alarms) -> list[str]:
    times = [one for one in back.values() if math.isfinite(one)]
    share = f"{len(times)} ({100.0 * len(times) / len(back):.1f} %)" if back else ""
    median = f"{np.median(times):.2f} s ({max(times):.2f} s)" if times else ""
    missed = ", ".join(f"{until:g} to {since:g} s" for (until, since), one in back.items() if math.isinf(one))
    stretches = ", ".join(f"{stamp:.1f} s of {drive}" for drive, stamp in alarms.at)
    count = f"{len(alarms.at)}: {stretches}" if alarms.at else "0"
    return [str(len(back)), share, median, missed, f"{alarms.driven:.0f} s", count, f"{100.0 * alarms.worst:.0f} cm"]


def kidnapped(drive: Drive, until: float, since: float, duration: float, begin: float = 0.0) -> Drive:
    """The drive from `begin` until a time [s], then what it was from `since` on, for a duration [s]: stamps and odometry go on smoothly.

    It is as if the robot were lifted for a moment with its wheels still: no sensor but the lidar notices.
    """
    before = [frame for frame in drive.frames if begin <= frame.stamp <= until]
    after = [frame for frame in drive.frames if since < frame.stamp <= since + duration]
    later = before[-1].stamp + PERIOD - after[0].stamp
    last = [reading for frame in before for reading in frame.odometry][-1].T_odom_base
    first = [reading for frame in drive.frames if frame.stamp <= since for reading in frame.odometry][-1].T_odom_base
    frames = (*before, *(_moved(frame, later, last @ first.inverse()) for frame in after))
    rows = [drive.pose(frame.stamp).as_array() for frame in (*before, *after)]
    return Drive(drive.world, frames, Trajectory(np.array([frame.stamp for frame in frames]), np.array(rows)), drive.walls)


def _moved(frame: SensorFrame, later: float, T_odom: SE2) -> SensorFrame:
    """A frame some time later [s], its odometry in another frame."""
    odometry: tuple[WheelOdometry, ...] = tuple(
        replace(one, stamp=one.stamp + later, T_odom_base=T_odom @ one.T_odom_base) for one in frame.odometry
    )
    imu: tuple[Imu, ...] = tuple(replace(one, stamp=one.stamp + later) for one in frame.imu)
    scans: tuple[LaserScan, ...] = tuple(replace(one, stamp=one.stamp + later) for one in frame.scans)
    return replace(frame, stamp=frame.stamp + later, odometry=odometry, imu=imu, scans=scans)
