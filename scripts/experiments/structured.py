"""`twin experiment structured`: document C's fixed tour through a structured world, x and y apart, and its badly mapped region A."""

from __future__ import annotations

from dataclasses import dataclass

from rich.console import Console

from scripts.experiments.contest import Method, Run, contest, methods
from scripts.experiments.drive import Course
from scripts.experiments.office_parts import EMPTY_OFFICE, PlacedMap, by_parts
from scripts.experiments.paper_table import PaperFigures, paper_table, write_results
from scripts.experiments.people_options import PeopleOptions
from scripts.options import parse
from slam.localization.localizability import Localizability

CONDITIONS = {"": EMPTY_OFFICE, "A moved": "office:people=0,displaced=true"}
"""What is special -> world of the drive; the map is that of the office as it was."""
PAPER = {"classic and method": PaperFigures(rmse=(4.0, 4.0, float("nan")))}


@dataclass(frozen=True)
class StructuredOptions(PeopleOptions):
    """Follow the office's fixed tour and localise by every method on the same recordings.

    The corridor is told apart, where no scan knows the way along it; so is region A, whose clutter stands elsewhere than in the map in
    the second condition.
    """


def main(argv: list[str]) -> int:
    """Map, drive, localise, print; returns the exit code.

    Raises:
        UsageError, SimError, WorldError, OutputError: with one line that says what to do.
    """
    options = parse(StructuredOptions, argv, "experiment structured")
    options.check()
    placed = PlacedMap.made()
    runs: list[Run] = []
    for condition, world in CONDITIONS.items():
        for seed in options.seeds:
            drive = Course(world, options.duration, seed).drive()
            runs += contest(placed.given, drive, seed, document_c(), condition)
    console = Console(width=170)
    console.print(paper_table("document C, structured tour, scored by where the map lies", by_parts(runs), PAPER))
    own = [placed.in_place(run) for run in runs]
    console.print(paper_table("the same against where each room lies in the map: without the map's own errors", by_parts(own)))
    if options.out is not None:
        write_results(options.out, "document C: structured tour", runs, placed.given)
    return 0


def document_c() -> dict[str, Method]:
    """Document C's method, its own fusion, the classic filter, and one with a robust field."""
    return methods("mcl", "amcl", "localizability", eq14=Localizability(fusion="eq14"))
