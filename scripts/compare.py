"""The verb `twin compare`: several pipelines on the same frames, judged side by side."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from rich.console import Console
from tyro.conf import Positional, arg

from scripts.errors import UsageError
from scripts.options import OptionalFile, parse

HELP = "run several pipelines on the same frames: one table, one picture, one page"


@dataclass(frozen=True)
class CompareOptions:
    """Run several pipelines on one recording, or on one drive through a simulated world, and compare them.

    $ twin compare runs/a --pipelines odometry lidar lidar_slam          a recording
    $ twin compare --world office --pipelines amcl mcl perfect_match     a world: mapped first, then driven and recorded once

    A drive through a world follows its tour by the truth, so that no pipeline decides where it goes. Localizers get `--map`;
    in a world without one, `lidar_slam` makes it on a drive of its own. Mapping pipelines are scored after alignment without
    scale, localizers without alignment, where their map lies.
    """

    recording: Annotated[Positional[Path | None], arg(metavar="RECORDING", help_behavior_hint="(default: none, drive --world)")] = None
    """Folder of a run with a recording, or any recording that `twin run --robot replay:` takes."""
    pipelines: Annotated[tuple[str, ...], arg(metavar="NAME")] = ("odometry", "icp_odometry", "lidar", "lidar_slam")
    """Pipelines to compare; `twin run --help` lists them."""
    world: Annotated[str, arg(metavar="NAME")] = "aruco_room"
    """World to drive through when there is no recording."""
    robot: Literal["sim", "kinematic"] = "sim"
    """Body that drives."""
    map: Annotated[Path | None, arg(metavar="PATH", help_behavior_hint="(default: made first)")] = None
    """Map for localizers: the folder of a run, or a map_server .yaml."""
    find: bool = False
    """Do not tell localizers where the robot starts, even where the truth is known."""
    duration: Annotated[float, arg(metavar="S")] = 60.0
    """Length of a drive [s]."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Seed of a drive's noise; the map is made with the next one."""
    realism: Annotated[str, arg(metavar="NAME")] = "datasheet"
    """How imperfect the simulated robot is; see `twin run --help`."""
    camera: Literal["raster", "embree", "none"] = "none"
    """What draws the images of a drive."""
    spec: OptionalFile = None
    """TOML file that describes the robot, as in `twin run`."""
    out: Annotated[Path, arg(metavar="FOLDER")] = field(default=Path("runs/compare"))
    """Folder for the results: compare.html, compare.png, compare.csv, and one run folder for each pipeline."""


def main(argv: list[str]) -> int:
    """Compare; returns the exit code.

    Raises:
        UsageError, HardwareError, SimError, SlamError, WorldError, OutputError: with one line that says what to do.
    """
    options = parse(CompareOptions, argv, "compare")
    if not options.pipelines or len(set(options.pipelines)) < len(options.pipelines):
        raise UsageError("--pipelines: name one or more, each once")
    from scripts.comparison.page import write_comparison  # late: options and their mistakes are answered before Numba is loaded
    from scripts.comparison.runs import run_all
    from scripts.comparison.table import csv_text, rich_table
    from scripts.runs.files import write_text

    records = run_all(options)
    Console(width=160).print(rich_table(records))
    write_text(options.out / "compare.csv", csv_text(records))
    write_comparison(options.out, records)
    print(f"\n{options.out / 'compare.html'}\n{options.out / 'compare.png'}")
    return 0
