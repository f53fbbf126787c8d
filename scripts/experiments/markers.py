"""`twin experiment markers`: document A's marker maps: how far apart markers may be, where the robot looks from, and who makes the map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table
from tyro.conf import arg

from scripts.bench.marker_scenes import map_errors, true_map
from scripts.errors import UsageError
from scripts.experiments.drive import Course
from scripts.experiments.markers_picture import write_markers_png
from scripts.options import parse
from scripts.runs.files import OutputError, write_text
from scripts.runs.loop import PERIOD
from scripts.runs.metrics import aligned_errors
from sim.ground_truth import ground_truth
from slam.landmarks.marker_chain import MarkerChain
from slam.landmarks.marker_map import MarkerMap
from slam.mapping.visual_slam import VisualSlam
from slam.messages import Estimate, Trajectory
from slam.navigation.perimeter import Perimeter
from slam.navigation.spin import Spin
from slam.se2 import SE2, FloatArray
from worlds.loader import load_world

POLICIES = {"spin": Spin, "perimeter": Perimeter}
METHODS = ("chain", "graph")
COLUMNS = "spacing_m,policy,method,markers,mapped,rms_mm,worst_mm,rotation_deg,robot_rms_mm"


@dataclass(frozen=True)
class MarkersExperimentOptions:
    """Map the aruco_room with markers closer and farther apart, once turning in its middle and once driving along its walls.

    `chain` is the report's way, `graph` that of `visual_slam`; both see the same sightings. The robot is driven by the truth. Errors are
    those of the markers that got into the map, after the best rigid motion.
    """

    spacings: Annotated[tuple[float, ...], arg(metavar="M...")] = (0.15, 0.25, 0.5, 0.75, 1.0, 1.5)
    """From marker to marker [m]."""
    duration: Annotated[float, arg(metavar="S")] = 90.0
    """Of a drive [s]; a lap along the walls takes 80."""
    seed: Annotated[int, arg(metavar="N")] = 1
    """Of all noise."""
    out: Annotated[Path | None, arg(metavar="FOLDER", help_behavior_hint="")] = None
    """Write the table as markers.csv and the picture as markers.png here."""


@dataclass(frozen=True, slots=True, eq=False)
class Mapped:
    """One map of one drive."""

    spacing: float
    """[m]"""
    policy: str
    method: str
    found: MarkerMap
    truth: MarkerMap
    way: FloatArray
    """(N, 3) true poses of the robot."""
    robot_rms: float
    """Position while mapping [m]; nan of the chain, which only locates the camera."""

    @property
    def errors(self) -> tuple[FloatArray, FloatArray]:
        """(N,) [m] and (N,) [rad] of the mapped markers."""
        return map_errors(self.found, self.truth) if self.found.markers else (np.empty(0), np.empty(0))

    @property
    def rms(self) -> float:
        """Of the markers' places [m]; nan where none was mapped."""
        off = self.errors[0]
        return float(np.sqrt(np.mean(off**2))) if len(off) else math.nan


def main(argv: list[str]) -> int:
    """Drive, map, print; returns the exit code.

    Raises:
        UsageError, SimError, WorldError, OutputError: with one line that says what to do.
    """
    options = parse(MarkersExperimentOptions, argv, "experiment markers")
    if not (math.isfinite(options.duration) and options.duration >= 1.0 and options.spacings):
        raise UsageError("give at least 1 second and one spacing")
    worlds = [(spacing, f"aruco_room:spacing={spacing:g}") for spacing in options.spacings]
    for _, world in worlds:
        load_world(world)
    maps = [found for spacing, world in worlds for policy in POLICIES for found in mapped(spacing, world, policy, options)]
    Console(width=130).print(_table(maps))
    if options.out is not None:
        try:
            options.out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(options.out, error) from error
        write_text(options.out / "markers.csv", "\n".join([COLUMNS, *(_line(found) for found in maps)]) + "\n")
        write_markers_png(options.out / "markers.png", maps)
    return 0


def mapped(spacing: float, world: str, policy: str, options: MarkersExperimentOptions) -> list[Mapped]:
    """Both maps of one drive."""
    cv2.setNumThreads(1)
    known = load_world(world)
    drives = POLICIES[policy]().build(np.array(known.tour, np.float64))
    pipeline, chain = VisualSlam().build(SE2(*known.start)), MarkerChain()
    stamps: list[float] = []
    true: list[FloatArray] = []
    said: list[FloatArray] = []
    with Course(world, options.duration, options.seed, camera="raster").body() as robot:
        truth = ground_truth(robot)
        while robot.clock.now() < options.duration and robot.clock.sleep_until(robot.clock.now() + PERIOD):
            frame = robot.read()
            estimate = pipeline.update(frame)
            if frame.images and pipeline.detection is not None:
                chain.update(pipeline.detection.sightings)
            pose = truth.pose(frame.stamp)
            stamps.append(frame.stamp)
            true.append(pose.as_array())
            said.append(estimate.T_map_base.as_array())
            robot.drive(drives(frame, Estimate(frame.stamp, pose, SE2(), np.eye(3)), pipeline.snapshot()))
    pipeline.finish()
    way, path = (Trajectory(np.array(stamps), np.array(poses)) for poses in (true, said))
    robot_rms = float(np.sqrt(np.mean(aligned_errors(way, path).errors.translation ** 2)))
    found = {"chain": chain.map(known.dictionary), "graph": pipeline.marker_map() or MarkerMap.of((), known.dictionary)}
    given = {"chain": math.nan, "graph": robot_rms}
    return [Mapped(spacing, policy, method, found[method], true_map(world), way.poses, given[method]) for method in METHODS]


def _figures(found: Mapped) -> tuple[float, float, float, float]:
    """RMS and worst [mm], median rotation [deg], robot's RMS [mm]."""
    off, turned = found.errors
    worst, rotation = (1e3 * float(off.max()), float(np.degrees(np.median(turned)))) if len(off) else (math.nan, math.nan)
    return 1e3 * found.rms, worst, rotation, 1e3 * found.robot_rms


def _line(found: Mapped) -> str:
    numbers = ",".join(f"{value:.4g}" for value in _figures(found))
    return f"{found.spacing:g},{found.policy},{found.method},{len(found.truth.markers)},{len(found.found.markers)},{numbers}"


def _table(maps: list[Mapped]) -> Table:
    columns = ("spacing [m]", "policy", "map by", "markers", "RMS [mm]", "worst [mm]", "rotation, median [deg]", "robot, RMS [mm]")
    table = Table(*(column.replace("[", r"\[") for column in columns), title="marker maps of the aruco_room", title_justify="left")
    for found in maps:
        cells = ["" if math.isnan(value) else f"{value:.3g}" for value in _figures(found)]
        count = f"{len(found.found.markers)} of {len(found.truth.markers)}"
        table.add_row(f"{found.spacing:g}", found.policy, found.method, count, *cells)
    return table
