"""`twin experiment icp`: what the choice of correspondences does to scan-to-scan ICP, as the source report compared it."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from rich.console import Console
from rich.table import Table
from tyro.conf import arg

from scripts.errors import UsageError
from scripts.experiments.arena import rmse
from scripts.experiments.drive import Course, Drive
from scripts.options import OptionalFile, parse
from scripts.runs.files import write_text
from slam.evaluation.poses import sample
from slam.evaluation.trajectory import pairs_by_distance, pairs_by_frames, relative_errors
from slam.matching.icp import Icp
from slam.matching.match import Match
from slam.messages import Trajectory
from slam.scans import deskew
from slam.se2 import SE2, FloatArray

LEG = 10.0
"""Length of the way over which drift is told [m]."""
NO_MOTION = Trajectory(np.empty(0), np.empty((0, 3)))

VARIANTS: dict[str, Icp] = {
    "nearest neighbour": Icp(trim=1.0, one_to_one=False),
    "within 0.3 m": Icp(trim=1.0, one_to_one=False, max_distance=0.3),
    "one to one": Icp(trim=1.0),
    "trimmed to 90 %": Icp(trim=0.9, one_to_one=False),
    "one to one, trimmed to 90 %": Icp(),
    "one to one, trimmed to 70 %": Icp(trim=0.7),
}


@dataclass(frozen=True)
class IcpExperimentOptions:
    """Lay every scan of a drive over the one before with each way to choose correspondences, and compare with the truth.

    The drive is recorded once, along the world's tour by the truth; every variant sees the same scans.
    """

    world: Annotated[str, arg(metavar="NAME")] = "aruco_room"
    """World of the simulation, as in `twin run`."""
    seed: Annotated[int, arg(metavar="N")] = 1
    """Seed of all noise."""
    duration: Annotated[float, arg(metavar="S")] = 60.0
    """Length of the drive [s]."""
    guess: Literal["odometry", "none", "both"] = "both"
    """Where ICP starts: from the wheels' motion, or from no motion as in the report."""
    deskew: bool = False
    """Undo the robot's motion during the sweep first, which the report did not."""
    csv: OptionalFile = None
    """Write the table to this file."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One variant over all pairs of scans."""

    name: str
    guess: str
    position_mm: float
    """RMS error of the step between two scans."""
    heading_deg: float
    drift_percent: float
    """Error over 10 m of way, RMS, in percent of it."""
    turn_deg: float
    """Heading error over 10 m of way, RMS."""
    converged: float
    steps: float
    milliseconds: float


def main(argv: list[str]) -> int:
    """Drive, match, print; returns the exit code.

    Raises:
        UsageError, SimError, WorldError, OutputError: with one line that says what to do.
    """
    options = parse(IcpExperimentOptions, argv, "experiment icp")
    if not (math.isfinite(options.duration) and options.duration >= 1.0):
        raise UsageError(f"--duration {options.duration:g}: give at least 1 second")
    course = Course(options.world, options.duration, options.seed, "sim").drive()
    guesses = ("odometry", "none") if options.guess == "both" else (options.guess,)
    outcomes = [run_variant(course, name, icp, guess, options.deskew) for guess in guesses for name, icp in VARIANTS.items()]
    Console(width=150).print(_table(options.world, outcomes))
    if options.csv is not None:
        write_text(options.csv, _csv(outcomes))
    return 0


def run_variant(course: Drive, name: str, icp: Icp, guess: str, undo_motion: bool = False) -> Outcome:
    """Match all pairs of consecutive scans of a drive."""
    wheels = wheel_poses(course)
    clouds = [deskew(scan, wheels if undo_motion else NO_MOTION).points for scan in course.scans]
    steps = _steps(wheels, np.array([scan.stamp for scan in course.scans]))
    began = time.perf_counter()
    pairs = zip(pairwise(clouds), steps, strict=True)
    matches = [icp.match(source, target, step if guess == "odometry" else SE2()) for (target, source), step in pairs]
    milliseconds = 1e3 * (time.perf_counter() - began) / max(len(matches), 1)
    return _outcome(course, name, guess, matches, milliseconds)


def wheel_poses(course: Drive) -> Trajectory:
    """`T_odom_base` of all wheel odometry."""
    readings = [reading for frame in course.frames for reading in frame.odometry]
    return Trajectory(np.array([r.stamp for r in readings]), np.array([r.T_odom_base.as_array() for r in readings]).reshape(-1, 3))


def _steps(trajectory: Trajectory, stamps: FloatArray) -> list[SE2]:
    """Motion from stamp to stamp."""
    poses = [SE2.from_array(pose) for pose in sample(trajectory, stamps)]
    return [a.inverse() @ b for a, b in pairwise(poses)]


def _outcome(course: Drive, name: str, guess: str, matches: list[Match], milliseconds: float) -> Outcome:
    truth = course.truth_at_scans()
    poses = [SE2.from_array(truth.poses[0])]
    for match in matches:
        poses.append(poses[-1] @ match.T_target_source)
    estimate = Trajectory(truth.stamps, np.array([pose.as_array() for pose in poses]))
    step = relative_errors(truth, estimate, pairs_by_frames(len(estimate), 1))
    legs = pairs_by_distance(truth, LEG)
    leg = relative_errors(truth, estimate, legs if len(legs) else np.array([[0, len(estimate) - 1]]))
    return Outcome(
        name,
        guess,
        1e3 * rmse(step.translation),
        math.degrees(rmse(step.heading)),
        100.0 * rmse(leg.translation) / LEG,
        math.degrees(rmse(leg.heading)),
        float(np.mean([match.converged for match in matches])),
        float(np.median([match.iterations for match in matches])),
        milliseconds,
    )


def _table(world: str, outcomes: list[Outcome]) -> Table:
    title = f"scan on scan in {world}: errors of a step, and over {LEG:g} m of way"
    columns = ("correspondences", "guess", "step [mm]", "step [deg]", "drift [%]", "turn [deg]", "converged", "steps", "ms a pair")
    table = Table(*columns, title=title, title_justify="left")
    for o in outcomes:
        cells = (f"{o.position_mm:.1f}", f"{o.heading_deg:.2f}", f"{o.drift_percent:.1f}", f"{o.turn_deg:.1f}")
        table.add_row(o.name, o.guess, *cells, f"{o.converged:.0%}", f"{o.steps:.0f}", f"{o.milliseconds:.1f}")
    return table


def _csv(outcomes: list[Outcome]) -> str:
    names = Outcome.__slots__
    rows = [",".join(str(getattr(outcome, name)).replace(",", ";") for name in names) for outcome in outcomes]
    return "\n".join([",".join(names), *rows]) + "\n"
