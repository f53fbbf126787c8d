"""`twin experiment hall`: document B's tour of a hall, from lidar and from the depth camera alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from tyro.conf import arg

from scripts.experiments.arena import map_of
from scripts.experiments.document_b import HALL, DocumentBOptions, depth_course
from scripts.experiments.drive import Course
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
        _show(chain, options)
    return 0


def hall_course(chain: Chain, duration: float, seed: int) -> Course:
    """Once round, as the chain sees it."""
    return Course("hall", duration, seed) if chain == "lidar" else depth_course("hall", duration, seed)


def hall_map(chain: Chain, duration: float, seed: int) -> GivenMap:
    """The hall as the chain's mapper makes it: lidar_slam, or rbpf."""
    return map_of(hall_course(chain, duration, seed).drive(), Rbpf().build() if chain == "depth" else None)


def _show(chain: Chain, options: HallOptions) -> None:
    contests = options.contests(
        lambda seed: hall_map(chain, options.duration, seed), lambda seed: {chain: hall_course(chain, options.duration, seed)}
    )
    contests.show(f"document B, hall tour, from {chain}", HALL, options.out and options.out / chain)
