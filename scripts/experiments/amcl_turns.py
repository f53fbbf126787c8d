"""Document A's failure: AMCL that turns on the spot, on a map from ICP and on odometry that ICP has corrected."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import numpy as np
from rich.console import Console
from tyro.conf import arg

from scripts.errors import UsageError
from scripts.experiments.arena import follow, map_of
from scripts.experiments.contest import Method, Run, contest, methods
from scripts.experiments.drive import Command, Course, Drive
from scripts.experiments.paper_table import paper_table, write_results
from scripts.options import parse
from slam.evaluation.poses import wrap_angles
from slam.mapping.icp_odometry import IcpOdometry
from slam.messages import Twist, WheelOdometry
from slam.se2 import SE2, FloatArray, wrap_angle
from worlds.loader import load_world

TURNING = 0.9
"""Yaw rate from which a moment counts as a turn [rad/s]."""
LEG = 1.5
"""Way between two turns [m]."""
AS_REPORTED, OURS = "ICP map, ICP odometry", "lidar_slam map, wheels and gyro"


@dataclass(frozen=True)
class TurnsOptions:
    """Drive from waypoint to waypoint, turn once round on the spot every 1.5 m, and localise on the same recording in two ways.

    As document A reports it: the map and the odometry both come from scan-to-scan ICP. And as it is done here: the map from
    lidar_slam, the motion from wheels and gyro. The document's error grows after pose 280, next to its last turn; it gives no figures.
    """

    world: Annotated[str, arg(metavar="NAME")] = "aruco_room"
    """World of the simulation, as in `twin run`."""
    pipelines: Annotated[tuple[str, ...], arg(metavar="NAME")] = ("mcl", "amcl")
    """Localizers to compare; wheel odometry is always there."""
    seeds: Annotated[tuple[int, ...], arg(metavar="N")] = field(default=(1, 2, 3))
    """Seeds of all noise, a recording each."""
    duration: Annotated[float, arg(metavar="S")] = 120.0
    """Length of a drive [s]."""
    out: Annotated[Path | None, arg(metavar="DIR", help_behavior_hint="(default: nothing is written)")] = None
    """Folder for table.csv, errors.csv and errors.png."""


def main(argv: list[str]) -> int:
    """Drive, localise, print; returns the exit code.

    Raises:
        UsageError, SimError, WorldError, SlamError, OutputError: with one line that says what to do.
    """
    options = parse(TurnsOptions, argv, "experiment amcl_turns")
    if not (math.isfinite(options.duration) and options.duration >= 10.0 and options.seeds):
        raise UsageError("--duration: give at least 10 seconds, and one seed or more")
    compared = methods(*options.pipelines)
    icp = {name: method for name, method in compared.items() if name != "odometry"}
    ours = map_of(Course(options.world, options.duration, 100).drive())
    runs: list[Run] = []
    for seed in options.seeds:
        drive = Course(options.world, options.duration, seed).drive(turning_tour(options.world))
        runs += _as_reported(drive, seed, icp) + contest(ours, drive, seed, compared, OURS)
    console = Console(width=170)
    for where, chosen in (("all the way", runs), ("in turns", [run.where(_turns(run)) for run in runs])):
        console.print(paper_table(f"AMCL and turns on the spot, {options.world}, {where}", chosen))
    if options.out is not None:
        write_results(options.out, "AMCL and turns on the spot", runs, ours)
    return 0


def turning_tour(world: str) -> Command:
    """From waypoint to waypoint, and every `LEG` once round on the spot; by the truth."""
    waypoints = np.array(load_world(world).tour, dtype=np.float64)
    target, turned, driven, last = 0, 0.0, 0.0, SE2(math.nan)

    def command(_: float, pose: SE2) -> Twist:
        nonlocal target, turned, driven, last
        if not math.isnan(last.x):
            turned, driven = turned + abs(wrap_angle(pose.yaw - last.yaw)), driven + math.hypot(pose.x - last.x, pose.y - last.y)
        last = pose
        if turned < math.tau:
            return Twist(0.0, 1.0)
        if driven > LEG:
            turned = driven = 0.0
        dx, dy = waypoints[target % len(waypoints)] - (pose.x, pose.y)
        if math.hypot(dx, dy) < 0.15:
            target += 1
        off = wrap_angle(math.atan2(dy, dx) - pose.yaw)
        return Twist(0.25 if abs(off) < 0.5 else 0.0, min(max(1.5 * off, -1.0), 1.0))

    return command


def _as_reported(drive: Drive, seed: int, compared: Mapping[str, Method]) -> list[Run]:
    """Localizers on what ICP made of the drive; ICP's own track is the odometry beside them."""
    pipeline = IcpOdometry().build()
    given = map_of(drive, pipeline)
    track = follow(IcpOdometry().build(), drive).estimate
    frames = tuple(
        replace(
            frame,
            odometry=(WheelOdometry(frame.stamp, SE2.from_array(pose)),),
            imu=(),
            available=frame.available - {"imu"},
        )
        for frame, pose in zip(drive.frames, track.poses, strict=True)
    )
    return contest(given, replace(drive, frames=frames), seed, {"odometry": methods("odometry")["odometry"], **compared}, AS_REPORTED)


def _turns(run: Run) -> FloatArray:
    """Which moments (N,) are turns."""
    steps, rates = np.diff(run.errors.stamps), np.diff(run.places[:, 2])
    turning = np.abs(wrap_angles(rates)) > TURNING * steps
    return np.concatenate([turning[:1], turning])
