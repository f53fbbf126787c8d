"""What document B's experiments have in common: options, what the paper reports, a map for every seed and the drives in it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from rich.console import Console
from tyro.conf import arg

from scripts.errors import UsageError
from scripts.experiments.contest import Method, Run, contest, methods
from scripts.experiments.drive import Course
from scripts.experiments.paper_table import PaperFigures, paper_table, write_results
from scripts.options import OptionalFile
from scripts.runs.known_map import GivenMap
from slam.depth_scans import DepthScan
from slam.messages import SensorFrame

MAPPING_SEED = 100
"""Added to the seed of a drive: the map is made in a run of its own."""
HALL = {"perfect match, Kinect": PaperFigures((13.3, 17.5, 0.12), (15.3, 20.2, 0.18))}
CORRIDOR = {"perfect match": PaperFigures(milliseconds=13.7), "particle filter": PaperFigures(milliseconds=21.8)}
DISTURBANCE = {
    "perfect match": PaperFigures((17.3, 17.5, 0.18), (21.3, 21.1, 0.26)),
    "perfect match, disturbed": PaperFigures((20.7, 21.6, 0.24), (25.7, 26.6, 0.31)),
}
"""Reported by the document, with the TurtleBot's own localization as the truth."""


@dataclass(frozen=True)
class DocumentBOptions:
    """Of all experiments of document B."""

    seeds: Annotated[tuple[int, ...], arg(metavar="N...")] = (1, 2, 3)
    """Seeds of the drives; each has a map of its own."""
    pipelines: Annotated[tuple[str, ...], arg(metavar="NAME...", help_behavior_hint="(default: all localizers)")] = ()
    """Localizers that run on the recordings, beside odometry."""
    out: OptionalFile = None
    """Write table, errors over time and their picture into this folder."""

    def check(self, duration: float) -> None:
        """Raise UsageError where an option makes no sense."""
        if not self.seeds or min(self.seeds) < 0:
            raise UsageError("--seeds: give one or more integers, 0 or above")
        if not (math.isfinite(duration) and duration >= 2.0):
            raise UsageError(f"--duration {duration:g}: give at least 2 seconds")

    def contests(self, mapper: Callable[[int], GivenMap], courses: Callable[[int], Mapping[str, Course]], **variants: Method) -> Contests:
        """With every seed make a map, by a seed of its own, and localise in it by every method on the same recordings.

        Args:
            mapper: makes the map from its seed.
            courses: the drives of a seed, by what is special about them.
            variants: methods beside those chosen.

        Raises:
            UnknownNameError, SimError, WorldError, SlamError: with one line that says what to do.
        """
        compared = methods(*self.pipelines) | variants
        maps = {seed: mapper(seed + MAPPING_SEED) for seed in self.seeds}
        runs = [
            run
            for seed, given in maps.items()
            for condition, course in courses(seed).items()
            for run in contest(given, course.drive(), seed, compared, condition)
        ]
        return Contests(runs, maps[self.seeds[0]])


@dataclass(frozen=True, eq=False)
class Contests:
    """All runs of an experiment, and the first seed's map."""

    runs: list[Run]
    given: GivenMap

    def show(self, title: str, paper: Mapping[str, PaperFigures], folder: Path | None, *lines: str) -> None:
        """Print the table and lines of one's own; write table, errors and picture into the folder.

        Raises:
            OutputError: it cannot be written.
        """
        console = Console(width=170)
        console.print(paper_table(title, self.runs, paper))
        for line in lines:
            console.print(line)
        if folder is not None:
            write_results(folder, title, self.runs, self.given)


def seen_by_depth(frame: SensorFrame) -> SensorFrame:
    """A frame whose scans are those of its depth images, so that every localizer can run on them; the images are left out."""
    depth = DepthScan()
    scans = tuple(depth.scan(image) for image in frame.images)
    return dataclasses.replace(frame, images=(), scans=scans, available=frame.available - {"images"} | {"scans"})


def depth_course(world: str, duration: float, seed: int) -> Course:
    """A drive whose only scans are those of the depth camera."""
    return Course(world, duration, seed, camera="raster", keep=seen_by_depth)
