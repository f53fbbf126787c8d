"""The verb `twin evaluate`: explorers side by side on frozen maps."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from rich.console import Console
from rich.table import Table
from tyro.conf import Positional, arg

from scripts.errors import UsageError
from scripts.options import OptionalFile, parse

if TYPE_CHECKING:
    from scripts.evaluation.episode import Episode, Trial

HELP = "compare explorers on frozen maps: a table with intervals, and curves"


@dataclass(frozen=True)
class EvaluateOptions:
    """Let explorers explore the maps of a split, and compare how much they see, how fast and on how long a way.

    $ twin evaluate                                        all of them on the 100 medium test maps
    $ twin evaluate nearest tsp --difficulty easy --maps 10
    $ twin evaluate nearest --robot sim --pose slam        with the physics, and SLAM in the loop
    $ twin evaluate --maps 20 --against sim                do both twins put the explorers in the same order?
    $ twin evaluate --engine ray --address auto            on the machines of a Ray cluster
    """

    explorers: Annotated[Positional[tuple[str, ...]], arg(metavar="EXPLORER")] = ()
    """Which; all when none is given."""
    split: Literal["train", "validation", "test"] = "test"
    """Maps to explore."""
    difficulty: Literal["easy", "medium", "complex"] = "medium"
    """How large they are."""
    maps: Annotated[int, arg(metavar="N")] = 100
    """Only the first so many."""
    robot: Literal["kinematic", "sim"] = "kinematic"
    """Which twin explores."""
    pose: Literal["truth", "odometry", "slam"] = "truth"
    """What its map is made with."""
    duration: Annotated[float, arg(metavar="S")] = 300.0
    """Time for each map [s]."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Of all that is drawn."""
    slam_maps: Annotated[int, arg(metavar="N")] = 0
    """On so many of the maps also with the pose by SLAM, for the errors of pose and map: minutes for each."""
    against: Literal["", "kinematic", "sim"] = ""
    """Also with this twin: do both put the explorers in the same order?"""
    engine: Literal["processes", "ray"] = "processes"
    """Who runs the episodes: processes, or the nodes of a Ray cluster, each with bricktwin installed. The results are the same."""
    address: Annotated[str, arg(metavar="A")] = ""
    """Of a Ray cluster, such as auto or HOST:6379; empty: one of this machine alone."""
    processes: Annotated[int, arg(metavar="N")] = 0
    """That run at the same time, 0: one for each processor; the results are the same."""
    markdown: OptionalFile = None
    """Also write the table as a page of the documents, with the curves beside it as a PNG."""
    out: Annotated[Path, arg(metavar="FOLDER")] = Path("runs/evaluate")
    """Folder for episodes.json, table.md and curves.png."""


def main(argv: list[str]) -> int:
    """Run; returns the exit code.

    Raises:
        UsageError, SplitError: an option cannot be.
        OutputError: the results cannot be written.
    """
    options = parse(EvaluateOptions, argv, "evaluate")
    trials = _trials(options)
    from scripts.evaluation.engines import run_all
    from scripts.evaluation.page import write_page, write_results
    from scripts.evaluation.statistics import HEADS, by_explorer, row

    episodes = run_all(trials, options.engine, options.address, options.processes)
    shown = [episode for episode in episodes if (episode.robot, episode.pose) == (options.robot, options.pose)]
    wrong = by_explorer([episode for episode in episodes if (episode.robot, episode.pose) == (options.robot, "slam")])
    rows = [row(name, group, wrong.get(name, ())) for name, group in by_explorer(shown).items()]
    write_results(options.out, rows, episodes, shown)
    if options.markdown is not None:
        write_page(options.markdown, rows, shown, shlex.join(argv), _told(options, len(shown) // len(rows)))
    _print(HEADS, rows, f"{options.split} {options.difficulty}, {options.robot}, pose by {options.pose}")
    if options.against:
        _print_ranking(shown, [episode for episode in episodes if episode.robot == options.against], options)
    print(f"wrote {options.out}/table.md, curves.png and episodes.json")
    return 0


def _trials(options: EvaluateOptions) -> list[Trial]:
    from scripts.evaluation.episode import Trial
    from sim.envs.explorers import EXPLORERS
    from worlds.splits import map_names

    _check(options, EXPLORERS)
    names = map_names(options.split, options.difficulty)[: options.maps]
    parts = [(options.robot, options.pose, names), (options.robot, "slam", names[: options.slam_maps])]
    if options.against:
        parts.append((options.against, options.pose, names))
    return [
        Trial(explorer, name.text, options.seed + i, robot, pose, round(10.0 * options.duration))
        for robot, pose, places in parts
        for explorer in options.explorers or tuple(EXPLORERS)
        for i, name in enumerate(places)
    ]


def _check(options: EvaluateOptions, known: Collection[str]) -> None:
    for name in options.explorers:
        if name not in known:
            raise UsageError(f"no explorer '{name}'; available: {', '.join(known)}")
    for option, value in (("maps", options.maps), ("duration", options.duration)):
        if not value >= 1:
            raise UsageError(f"--{option} {value:g}: give 1 or more")
    if options.seed < 0 or options.processes < 0 or options.slam_maps < 0:
        raise UsageError("--seed, --processes and --slam-maps: give 0 or more")
    if options.against == options.robot:
        raise UsageError(f"--against {options.against} is what explores already; give the other twin")
    if options.slam_maps and options.pose == "slam":
        raise UsageError("--slam-maps adds to another pose; with --pose slam all maps have it")


def _told(options: EvaluateOptions, maps: int) -> str:
    """What was run, in sentences."""
    told = f"{maps} {options.difficulty} maps of `{options.split}`, {options.duration:g} s for each, robot `{options.robot}`, "
    told += f"pose by `{options.pose}`."
    if options.slam_maps:
        told += f" ATE and IoU are of the first {min(options.slam_maps, maps)} of the maps with the pose by `slam`."
    return told


def _print(heads: Sequence[str], rows: Sequence[Sequence[str]], title: str) -> None:
    table = Table(*heads, title=title, title_justify="left")
    for line in rows:
        table.add_row(*line)
    Console(width=220).print(table)


def _print_ranking(one: Sequence[Episode], other: Sequence[Episode], options: EvaluateOptions) -> None:
    from scripts.evaluation import ranking

    scores = ranking.scores(one), ranking.scores(other)
    _print(ranking.HEADS, ranking.rows(*scores), f"order on {options.robot}, then on {options.against}")
    print(ranking.verdict(*scores))
