"""`twin experiment hall`: document B's tour of a hall, from lidar and from the depth camera alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from rich.console import Console
from tyro.conf import arg

from scripts.experiments.arena import map_of, mapped
from scripts.experiments.contest import Run, contest
from scripts.experiments.document_b import HALL, MAPPING_SEED, DocumentBOptions, depth_course
from scripts.experiments.drive import Course
from scripts.experiments.paper_table import paper_table, write_results
from scripts.options import parse
from scripts.runs.known_map import GivenMap
from slam.mapping.rbpf import Rbpf

Chain = Literal["lidar", "depth"]


@dataclass(frozen=True)
class HallOptions(DocumentBOptions):
    """Go round a hall and localise by every method on the same recordings.

    `lidar`: the map by lidar_slam, scans of the lidar. `depth` is document B's own chain: the map by rbpf from depth images, and scans
    made of depth images; drawing them takes as long as the drive.
    """

    duration: Annotated[float, arg(metavar="S")] = 100.0
    """Length of a drive [s]; once round takes 95."""
    chain: Literal["lidar", "depth", "both"] = "both"
    """From what is mapped and localised."""


def main(argv: list[str]) -> int:
    """Map, drive, localise, print; returns the exit code.

    Raises:
        UsageError, SimError, WorldError, SlamError, OutputError: with one line that says what to do.
    """
    options = parse(HallOptions, argv, "experiment hall")
    options.check(options.duration)
    chains: tuple[Chain, ...] = ("lidar", "depth") if options.chain == "both" else (options.chain,)
    for chain in chains:
        runs: list[Run] = []
        shown: GivenMap | None = None
        for seed in options.seeds:
            given = hall_map(chain, options.duration, seed + MAPPING_SEED)
            shown = shown or given
            course = Course("hall", options.duration, seed) if chain == "lidar" else depth_course("hall", options.duration, seed)
            runs += contest(given, course.drive(), seed, options.methods(), chain)
        title = f"document B, hall tour, from {chain}"
        Console(width=170).print(paper_table(title, runs, HALL))
        if options.out is not None and shown is not None:
            write_results(options.out / chain, title, runs, shown)
    return 0


def hall_map(chain: Chain, duration: float, seed: int) -> GivenMap:
    """The hall as the chain's mapper sees it."""
    if chain == "lidar":
        return mapped("hall", duration, seed)
    return map_of(depth_course("hall", duration, seed).drive(), Rbpf().build())
