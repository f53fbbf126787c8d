"""`compare.html`: the table, the picture, and the way to each run's own page."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path
from string import Template

from scripts.comparison.picture import colours, write_picture
from scripts.comparison.table import rows, titles
from scripts.runs.files import write_text
from scripts.runs.record import RunRecord

_PAGE = Template("""<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
  body { font: 16px/1.5 system-ui, sans-serif; color: #22303c; background: #f7f8f9; max-width: 80rem; margin: 2rem auto; padding: 0 1rem; }
  img { max-width: 100%; border: 1px solid #dde2e6; border-radius: 6px; background: #fff; margin-top: 1.5rem; }
  table { border-collapse: collapse; background: #fff; }
  th, td { padding: .3rem .9rem; border: 1px solid #dde2e6; text-align: right; font-variant-numeric: tabular-nums; }
  th:nth-child(-n+2), td:nth-child(-n+2) { text-align: left; }
  i { display: inline-block; width: .8em; height: .8em; border-radius: 2px; margin-right: .5em; }
</style>
<h1>$title</h1>
<table>
<tr>$header</tr>
$rows
</table>
<img src="compare.png" alt="$title: all paths, and their errors over time">
<p>All pipelines saw the same frames. "aligned": the trajectory is laid on the truth without scale, as mapping has no origin of its own;
"in its map": no alignment, the map lies where the run that made it says. <a href="compare.csv">compare.csv</a> has every figure.</p>
</html>
""")


def write_comparison(folder: Path, records: Mapping[str, RunRecord]) -> None:
    """Write compare.png and compare.html.

    Raises:
        OutputError: a file cannot be written.
        TrajectoryError: truth and estimate do not overlap in time.
    """
    write_picture(folder / "compare.png", records)
    colour = colours(records)
    title = "Pipelines compared: " + ", ".join(records)
    header = "".join(f"<th>{escape(name)}</th>" for name in titles(records))
    body = "\n".join(_row(row, colour[row[0]]) for row in rows(records))
    write_text(folder / "compare.html", _PAGE.substitute(title=escape(title), header=header, rows=body))


def _row(row: list[str], colour: str) -> str:
    name, *cells = (escape(cell) for cell in row)
    link = f'<td><i style="background: {colour}"></i><a href="{name}/report.html">{name}</a></td>'
    return f"<tr>{link}{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"
