"""`twin experiment explore`: unattended exploration of frozen maps with SLAM in the loop, each map once."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from tyro.conf import arg

from hardware.errors import HardwareError
from scripts.errors import UsageError
from scripts.options import parse
from scripts.processes import spread
from scripts.runs.execute import measure
from scripts.runs.files import write_text
from scripts.runs.options import RunOptions
from sim.errors import SimError
from slam.errors import SlamError, UnknownNameError
from slam.pipelines import PIPELINES
from worlds.splits import FAMILIES, map_names

GOAL = 0.98
"""Share of the reachable area that must be mapped."""


@dataclass(frozen=True)
class ExploreOptions:
    """Let `--policy explore` map the maps of a split and come home; tell on how many it maps 98 % of what can be seen, ends, and touches
    nothing.

    $ twin experiment explore --robot sim               the 100 medium test maps with the physics
    $ twin experiment explore --maps 16 --family cave   some of them, without PyBullet
    """

    robot: Literal["kinematic", "sim"] = "kinematic"
    """Which twin explores."""
    pipeline: str = "lidar_slam"
    """What makes its map."""
    explorer: Literal["nearest", "utility", "gain"] = "nearest"
    """Which frontier is next."""
    split: Literal["train", "validation", "test"] = "test"
    """Maps to explore."""
    difficulty: Literal["easy", "medium", "complex"] = "medium"
    """How large they are."""
    family: Annotated[str, arg(metavar="NAME", help_behavior_hint="(default: all)")] = ""
    """Only maps of this generator."""
    first: Annotated[int, arg(metavar="N")] = 0
    """How many of them are left out at the beginning."""
    maps: Annotated[int, arg(metavar="N")] = 100
    """How many are explored."""
    duration: Annotated[float, arg(metavar="S")] = 1800.0
    """Time for each [s]; who has not come to an end then hangs."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Of all noise; a map's number is added to it."""
    realism: str = "datasheet"
    """How imperfect the robot is, as `twin run --realism` has it."""
    processes: Annotated[int, arg(metavar="N")] = 0
    """That run at the same time, 0: one for each processor; the results are the same."""
    json: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="(default: none)")] = None
    """File for all that is known of every map."""


@dataclass(frozen=True)
class Exploration:
    """How one map went."""

    world: str
    seed: int
    ended: bool
    """Whether the policy came to an end by itself."""
    reason: str
    """Why it ended."""
    coverage: float = 0.0
    """Share of the reachable area that is mapped."""
    collisions: int = 0
    time: float = 0.0
    """[s]"""
    path: float = 0.0
    """[m]"""
    rmse: float = math.nan
    """Of the position while it drove [m]."""

    @property
    def is_good(self) -> bool:
        """Whether nothing is left to be wished for."""
        return self.ended and self.coverage >= GOAL and self.collisions == 0


def main(argv: list[str]) -> int:
    """Explore and print; returns the exit code.

    Raises:
        UsageError, UnknownNameError, SplitError, OutputError: with one line that says what to do.
    """
    options = parse(ExploreOptions, argv, "experiment explore")
    found: list[Exploration] = []
    for one in explorations(options):
        found.append(one)
        if options.json is not None:  # after every map: hours may be broken off
            write_text(options.json, json.dumps([dataclasses.asdict(one) for one in found], indent=1) + "\n")
    console = Console(width=170)
    console.print(summary(found))
    for one in found:
        if not one.is_good:
            told = f"{100.0 * one.coverage:.2f} %, {one.collisions} collisions, {one.time:.0f} s: {one.reason}"
            command = f"twin run --robot {options.robot} --world {one.world} --pipeline {options.pipeline} --policy explore"
            console.print(
                f"{told}\n  {command} --explorer {options.explorer} --duration {options.duration:g} --seed {one.seed}", soft_wrap=True
            )
    return 0


def explorations(options: ExploreOptions) -> Iterator[Exploration]:
    """Every map explored once, each as soon as it is known, in the order of the maps whoever explores them.

    Raises:
        UsageError, UnknownNameError, SplitError: an option cannot be.
    """
    trials = _trials(options)
    return iter(track(spread(explore, trials, options.processes), "maps", total=len(trials), console=Console(stderr=True)))


def explore(trial: RunOptions) -> Exploration:
    """One map; a run that breaks off is told of, the others go on."""
    try:
        record = measure(trial)
    except (HardwareError, SimError, SlamError) as error:
        return Exploration(trial.world, trial.seed, ended=False, reason=str(error))
    metrics, outcome = record.metrics, record.outcome
    return Exploration(
        trial.world,
        trial.seed,
        ended=outcome is not None,
        reason=outcome.reason if outcome is not None else "the time is over",
        coverage=metrics.get("coverage", 0.0),
        collisions=record.collisions or 0,
        time=float(record.estimate.stamps[-1]),
        path=metrics.get("path_m", 0.0),
        rmse=metrics.get("position_rmse_m", math.nan),
    )


def summary(found: list[Exploration]) -> Table:
    """One line for each family and one for all."""
    table = Table("maps", "", "98 % mapped", "least coverage", "ended", "collisions", "time, median", "way, median", "position RMSE, worst")
    families = [(family, [one for one in found if one.world.startswith(f"{family}:")]) for family in FAMILIES]
    for name, group in [*families, ("all", found)]:
        if group:
            table.add_row(name, *_cells(group))
    return table


def _cells(group: list[Exploration]) -> list[str]:
    covered, ended = sum(one.coverage >= GOAL for one in group), sum(one.ended for one in group)
    return [
        str(len(group)),
        f"{covered} ({100.0 * covered / len(group):.1f} %)",
        f"{100.0 * min(one.coverage for one in group):.2f} %",
        str(ended),
        str(sum(one.collisions for one in group)),
        f"{np.median([one.time for one in group]):.0f} s",
        f"{np.median([one.path for one in group]):.1f} m",
        f"{100.0 * max(one.rmse for one in group):.1f} cm",
    ]


def _trials(options: ExploreOptions) -> list[RunOptions]:
    if min(options.seed, options.first, options.processes) < 0 or options.maps < 1:
        raise UsageError("--maps: 1 or above; --first, --seed and --processes: 0 or above")
    if options.pipeline not in PIPELINES:
        raise UnknownNameError("pipeline", options.pipeline, sorted(PIPELINES))
    names = map_names(options.split, options.difficulty, options.family)[options.first : options.first + options.maps]
    if not names:
        raise UsageError(f"--first {options.first}: there are not so many such maps")
    shared = RunOptions(
        robot=options.robot,
        pipeline=options.pipeline,
        policy="explore",
        explorer=options.explorer,
        duration=options.duration,
        realism=options.realism,
    )
    return [dataclasses.replace(shared, world=name.text, seed=options.seed + name.index) for name in names]
