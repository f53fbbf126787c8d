"""`twin worlds splits`: whether the frozen maps for exploring still come out as they were."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass
from typing import Annotated

from rich.console import Console
from rich.progress import track
from rich.table import Table
from tyro.conf import arg

from scripts.runs.files import write_text
from worlds.splits import DIGESTS, SPLITS, MapName, SplitError, map_names, measured, pinned


@dataclass(frozen=True)
class CheckSplits:
    """Generate the frozen maps for exploring anew and compare each with its digest."""

    every: Annotated[int, arg(metavar="N")] = 1
    """Only every so manieth map."""
    freeze: bool = False
    """Write the digests as the maps are now: for a new family, never to hide a change."""

    def run(self) -> None:
        """Print how many maps there are of each split and how long they took.

        Raises:
            SplitError: a map has changed.
        """
        if self.every < 1:
            raise SplitError(f"--every {self.every}: give 1 or more")
        names = [name for split in SPLITS for name in map_names(split)][:: 1 if self.freeze else self.every]
        began = time.thread_time()
        found = {name: measured(name) for name in track(names, "maps", console=Console(stderr=True))}
        seconds = time.thread_time() - began
        if self.freeze:
            lines = [f"{split} {''.join(found[name] for name in map_names(split))}" for split in SPLITS]
            write_text(DIGESTS, "\n".join(lines) + "\n")
        else:
            _compare(found)
        Console().print(_table(names))
        print(f"{len(names)} maps as they were frozen, {1000 * seconds / len(names):.1f} ms each")


def _compare(found: dict[MapName, str]) -> None:
    frozen = pinned()
    changed = [name for name, digest in found.items() if digest != frozen[name]]
    if changed:
        raise SplitError(f"{len(changed)} of {len(found)} maps have changed since they were frozen, the first is {changed[0].text}")


def _table(names: list[MapName]) -> Table:
    table = Table("split", "difficulty", "maps", title="Maps for exploring", title_justify="left")
    for (split, difficulty), count in Counter((name.split, name.difficulty) for name in names).items():
        table.add_row(split, difficulty, str(count))
    return table
