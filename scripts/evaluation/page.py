"""What `twin evaluate` leaves behind: a table, the curves and every episode, and a page for the documents."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path

from scripts.evaluation.episode import Episode
from scripts.evaluation.statistics import by_explorer, draw_curves, markdown
from scripts.runs.files import write_text, write_via

PAGE = """# Explorers

`twin evaluate {command}` wrote this page.

{what} Means with bootstrap intervals of 95 % over the maps; path and time only of the maps on which a share was reached, how many stands
in brackets. AUC is the mean coverage over the time given. What the explorers do stands under [environments](environments.md).

{table}
![Area seen over the time]({picture})
"""


def write_results(folder: Path, rows: Sequence[Sequence[str]], episodes: Sequence[Episode], shown: Sequence[Episode]) -> None:
    """Write table.md, curves.png of the episodes shown, and episodes.json of all.

    Raises:
        OutputError: a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "episodes.json", json.dumps([dataclasses.asdict(episode) for episode in episodes], indent=1) + "\n")
    write_text(folder / "table.md", markdown(rows))
    write_via(folder / "curves.png", lambda path: draw_curves(by_explorer(shown), path))


def write_page(path: Path, rows: Sequence[Sequence[str]], shown: Sequence[Episode], command: str, what: str) -> None:
    """Write a page of the documents, and its curves beside it; `what` says in sentences what was run.

    Raises:
        OutputError: a file cannot be written.
    """
    picture = path.with_suffix(".png")
    write_via(picture, lambda partial: draw_curves(by_explorer(shown), partial))
    write_text(path, PAGE.format(command=command, what=what, table=markdown(rows), picture=picture.name))
