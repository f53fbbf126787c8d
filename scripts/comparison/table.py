"""The figures of several runs side by side."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping

from rich.table import Table

from scripts.runs.record import RunRecord

COLUMNS = (
    ("position_rmse_m", "position RMSE", 1e3, "{:.1f} mm"),
    ("position_max_m", "at worst", 1e3, "{:.1f} mm"),
    ("heading_rmse_deg", "heading RMSE", 1.0, "{:.2f}°"),
    ("wall_rms_m", "walls, RMS", 1e3, "{:.1f} mm"),
    ("wall_recall", "walls found", 1e2, "{:.1f} %"),
    ("update_ms_median", "update", 1.0, "{:.2f} ms"),
    ("update_ms_p99", "slowest 1 %", 1.0, "{:.2f} ms"),
    ("frames_degraded", "degraded", 1.0, "{:.0f}"),
    ("frames_lost", "lost", 1.0, "{:.0f}"),
)
"""Key, title, factor to the unit shown, format."""


def titles(records: Mapping[str, RunRecord]) -> list[str]:
    """The header: only figures that some run has."""
    return ["pipeline", "scored", *(title for key, title, _, _ in COLUMNS if _known(records, key))]


def rows(records: Mapping[str, RunRecord]) -> list[list[str]]:
    """One row for each run, as `titles`; a figure that cannot be known is a dash."""
    table: list[list[str]] = []
    for name, record in records.items():
        scored = "-" if record.truth is None else "aligned" if record.T_world_map is None else "in its map"
        cells = [
            form.format(factor * record.metrics[key]) if key in record.metrics else "-"
            for key, _, factor, form in COLUMNS
            if _known(records, key)
        ]
        table.append([name, scored, *cells])
    return table


def rich_table(records: Mapping[str, RunRecord]) -> Table:
    """The table for a terminal."""
    table = Table()
    for k, title in enumerate(titles(records)):
        table.add_column(title, justify="left" if k < 2 else "right")
    for row in rows(records):
        table.add_row(*row)
    return table


def csv_text(records: Mapping[str, RunRecord]) -> str:
    """All figures of all runs in SI units, one run a row."""
    keys = list(dict.fromkeys(key for record in records.values() for key in record.metrics))
    text = io.StringIO()
    writer = csv.DictWriter(text, ["pipeline", *keys], lineterminator="\n")
    writer.writeheader()
    for name, record in records.items():
        writer.writerow({"pipeline": name, **record.metrics})
    return text.getvalue()


def _known(records: Mapping[str, RunRecord], key: str) -> bool:
    return any(key in record.metrics for record in records.values())
