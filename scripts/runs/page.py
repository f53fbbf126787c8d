"""`report.html`: one page with the pictures and the figures of a run."""

from __future__ import annotations

from html import escape
from pathlib import Path
from string import Template

from scripts.runs.files import write_text
from scripts.runs.record import RunRecord

_PAGE = Template("""<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
  body { font: 16px/1.5 system-ui, sans-serif; color: #22303c; background: #f7f8f9; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; }
  img { max-width: 100%; border: 1px solid #dde2e6; border-radius: 6px; background: #fff; }
  section { display: flex; flex-wrap: wrap; gap: 2rem; align-items: flex-start; margin-top: 1.5rem; }
  table { border-collapse: collapse; background: #fff; }
  td { padding: .25rem .9rem; border: 1px solid #dde2e6; }
  caption { text-align: left; font-weight: 600; padding-bottom: .4rem; }
  li { margin: .2rem 0; }
  td + td { text-align: right; font-variant-numeric: tabular-nums; }
</style>
<img src="report.png" alt="$title: map, trajectories and errors over time">
<section>
<img src="run.gif" alt="The run as it happened" style="flex: 1 1 24rem; max-width: 36rem">
<table>
<caption>All figures</caption>
$rows
</table>
</section>
$outcome$particles$markers<p>Beside this page:</p>
<ul>
<li><a href="config.toml">config.toml</a>: what was run, with every parameter;
<code>twin run --params config.toml</code> uses them again</li>
<li><a href="metrics.json">metrics.json</a>: these figures</li>
<li><a href="trajectory.tum">trajectory.tum</a>, <a href="trajectory_final.tum">trajectory_final.tum</a>,
<a href="odometry.tum">odometry.tum</a>:
the estimate as it was known at every frame, at every scan after all corrections, and the wheels alone (TUM format)</li>
<li><a href="map.yaml">map.yaml</a>, <a href="map.pgm">map.pgm</a>: the map, as map_server and nav2 read it,
and <a href="map.hits.npz">map.hits.npz</a>: where in each cell the wall was hit, for localizers</li>
</ul>
</html>
""")

PARTICLES = '<p><img src="particles.png" alt="Particles: where they were, how many counted, their weights and spread over time"></p>\n'
MARKERS = '<p><img src="markers.gif" alt="The camera\'s picture with axes on each marker, and the marker map in space"></p>\n'


def write_page(path: Path, run: RunRecord) -> None:
    """Write the page; it shows report.png, run.gif and, where it is, markers.gif from its own folder.

    Raises:
        OutputError: the file cannot be written.
    """
    particles = PARTICLES if len(run.beliefs.stamps) else ""
    markers = MARKERS if (path.parent / "markers.gif").exists() else ""
    outcome = f"<p>The drive ended: {escape(run.outcome.reason)}.</p>\n" if run.outcome is not None else ""
    rows = "\n".join(f"<tr><td>{escape(key)}</td><td>{value:.4g}</td></tr>" for key, value in run.metrics.items())
    write_text(path, _PAGE.substitute(title=escape(run.title), rows=rows, particles=particles, markers=markers, outcome=outcome))
