"""The verb `twin bench`: every speed and accuracy figure, measured now, on this machine."""

from __future__ import annotations

import dataclasses
import importlib
import itertools
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from rich.console import Console
from rich.table import Table
from tyro.conf import Positional, arg

from scripts.bench.row import Row
from scripts.errors import UsageError
from scripts.options import OptionalFile, parse
from scripts.runs.files import write_text

HELP = "measure speed and accuracy on this machine, side by side with peers in the same run"

GROUPS = (
    "rays",
    "grid_rays",
    "matching",
    "correlative",
    "posegraph",
    "slam",
    "localization",
    "perfect_match",
    "camera",
    "markers",
    "fusion",
    "people",
    "localizability",
    "global_localization",
    "twin",
    "realism",
    "odometry",
    "protocols",
    "wire",
    "demo",
    "recordings",
    "envs",
)

PARTS = {"wire": tuple(f"wire.{part}" for part in ("stops", "stamps", "faults", "soak", "slam"))}
"""Groups that are measured in parts, each of which can be chosen alone."""


@dataclass(frozen=True)
class BenchOptions:
    """Measure groups of figures, all or some; demo makes ten runs; recordings, slam and posegraph need the public data."""

    groups: Annotated[Positional[tuple[str, ...]], arg(metavar="GROUP")] = ()
    """Groups to measure, or parts of one as wire.faults; all when none is given and none read."""
    read: Annotated[tuple[Path, ...], arg(metavar="FILE...")] = ()
    """Take up the rows of other groups from files that --json wrote."""
    smoke: bool = False
    """Only see that everything runs; the figures mean nothing."""
    json: OptionalFile = None
    """Write the rows to this file."""
    markdown: OptionalFile = None
    """Write the rows as a page, as docs/results.md."""


def main(argv: list[str]) -> int:
    """Run; returns the exit code."""
    options = parse(BenchOptions, argv, "bench")
    known = (*GROUPS, *(part for parts in PARTS.values() for part in parts))
    for group in options.groups:
        if group not in known:
            raise UsageError(f"no group '{group}'; available: {', '.join(known)}")
    rows = [row for file in options.read for row in _read(file) if row.group not in options.groups]
    _keep(rows, options)
    for group in options.groups or (() if options.read else GROUPS):
        for part in PARTS.get(group, (group,)):
            _measure(part, options, rows)
    return 0


def _measure(part: str, options: BenchOptions, rows: list[Row]) -> None:
    """Add the rows of a group or a part to `rows`, print and write them; those that are known also when it is broken off."""
    measured: list[Row] = []
    try:
        measured.extend(importlib.import_module(f"scripts.bench.{part}").run(options.smoke))  # row by row, as they are known
    finally:
        Console(width=150).print(_table(part, measured))
        rows += measured
        _keep(rows, options)


def _keep(rows: list[Row], options: BenchOptions) -> None:
    """Write what is known so far: hours of measuring may be broken off."""
    rows.sort(key=lambda row: GROUPS.index(row.group))
    if options.json is not None:
        write_text(options.json, json.dumps([{**dataclasses.asdict(row), "command": row.command} for row in rows], indent=2) + "\n")
    if options.markdown is not None:
        write_text(options.markdown, _markdown(rows))


def _read(file: Path) -> list[Row]:
    try:
        rows = [
            Row(**{name: value for name, value in row.items() if name != "command"}) for row in json.loads(file.read_text(encoding="utf-8"))
        ]
    except (OSError, ValueError, TypeError, AttributeError) as error:
        raise UsageError(f"--read {file}: not a file that `twin bench --json` wrote: {error}") from error
    for row in rows:
        if row.group not in GROUPS:
            raise UsageError(f"--read {file}: no group '{row.group}'; available: {', '.join(GROUPS)}")
    return rows


def _table(group: str, rows: list[Row]) -> Table:
    table = Table(group, "value", "unit", "reach", "peer", "peer's value", "ratio", title_justify="left")
    for row in rows:
        table.add_row(*_cells(row))
    return table


def _markdown(rows: list[Row]) -> str:
    lines = [
        "# Results",
        "",
        "Written by `twin bench --markdown docs/results.md`, each table by the command above it. Peers ran in the same process run, "
        "but for those whose figures were published. How explorers compare is [a table of its own](explorers.md).",
    ]
    for command, group in itertools.groupby(rows, key=lambda row: row.command):
        lines += [
            "",
            f"## `{command}`",
            "",
            "| what | value | unit | reach | peer | peer's value | ratio |",
            "|---|---:|---|---|---|---:|---:|",
        ]
        lines += [f"| {' | '.join(_cells(row))} |" for row in group]
    return "\n".join(lines) + "\n"


def _cells(row: Row) -> tuple[str, ...]:
    peer_value = "" if row.peer_value is None else f"{row.peer_value:.4g}"
    ratio = "" if row.ratio is None else f"{row.ratio:.2f}"
    return row.name, f"{row.value:.4g}", row.unit, row.reach, row.peer, peer_value, ratio
