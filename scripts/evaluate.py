"""The verb `twin evaluate`: explorers side by side on frozen maps."""

from __future__ import annotations

import dataclasses
import json
import multiprocessing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from rich.console import Console
from rich.progress import track
from rich.table import Table
from tyro.conf import Positional, arg

from scripts.errors import UsageError
from scripts.options import parse
from scripts.runs.files import write_text, write_via

if TYPE_CHECKING:
    from scripts.evaluation.episode import Episode, Trial

HELP = "compare explorers on frozen maps: a table with intervals, and curves"


@dataclass(frozen=True)
class EvaluateOptions:
    """Let explorers explore the maps of a split, and compare how much they see, how fast and on how long a way.

    $ twin evaluate                                        all of them on the 100 medium test maps
    $ twin evaluate nearest tsp --difficulty easy --maps 10
    $ twin evaluate nearest --robot sim --pose slam        with the physics, and SLAM in the loop
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
    processes: Annotated[int, arg(metavar="N")] = 0
    """That run at the same time, 0: one for each processor; the results are the same."""
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
    from scripts.evaluation.statistics import HEADS, draw_curves, markdown, row

    episodes = _run(trials, options.processes)
    groups: dict[str, list[Episode]] = {}
    for episode in episodes:
        groups.setdefault(episode.explorer, []).append(episode)
    rows = [row(name, group) for name, group in groups.items()]
    options.out.mkdir(parents=True, exist_ok=True)
    write_text(options.out / "episodes.json", json.dumps([dataclasses.asdict(episode) for episode in episodes], indent=1) + "\n")
    write_text(options.out / "table.md", markdown(rows))
    write_via(options.out / "curves.png", lambda path: draw_curves(groups, path))
    table = Table(*HEADS, title=f"{options.split} {options.difficulty}, {options.robot}, pose by {options.pose}", title_justify="left")
    for line in rows:
        table.add_row(*line)
    Console(width=200).print(table)
    print(f"wrote {options.out}/table.md, curves.png and episodes.json")
    return 0


def _trials(options: EvaluateOptions) -> list[Trial]:
    from scripts.evaluation.episode import Trial
    from sim.envs.explorers import EXPLORERS
    from worlds.splits import map_names

    for name in options.explorers:
        if name not in EXPLORERS:
            raise UsageError(f"no explorer '{name}'; available: {', '.join(EXPLORERS)}")
    for option, value in (("maps", options.maps), ("duration", options.duration)):
        if not value >= 1:
            raise UsageError(f"--{option} {value:g}: give 1 or more")
    if options.seed < 0 or options.processes < 0:
        raise UsageError("--seed and --processes: give 0 or more")
    steps = round(10.0 * options.duration)
    names = map_names(options.split, options.difficulty)[: options.maps]
    return [
        Trial(explorer, name.text, options.seed + i, options.robot, options.pose, steps)
        for explorer in options.explorers or tuple(EXPLORERS)
        for i, name in enumerate(names)
    ]


def _run(trials: list[Trial], processes: int) -> list[Episode]:
    """All episodes, in the order of the trials whoever runs them."""
    from scripts.evaluation.episode import run

    console = Console(stderr=True)
    count = min(processes or multiprocessing.cpu_count(), len(trials))
    if count == 1:
        return [run(trial) for trial in track(trials, "episodes", console=console)]
    with multiprocessing.get_context("spawn").Pool(count) as pool:
        return list(track(pool.imap(run, trials), "episodes", total=len(trials), console=console))
