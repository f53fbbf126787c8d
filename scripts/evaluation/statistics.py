"""From episodes to a table and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from scripts.evaluation.episode import Episode
from sim.envs.tally import MARKS

DRAWS = 2000
"""Of the bootstrap."""
CONFIDENCE = 0.95
Interval = tuple[float, float, float]
"""Mean, and lower and upper end of its bootstrap interval; nan where there is nothing."""
HEADS = [
    "explorer",
    "coverage [%]",
    "AUC [%]",
    *(f"path, time to {mark} %" for mark in MARKS),
    "collisions",
    "decision [ms]",
    "ATE [cm]",
    "IoU [%]",
]


def bootstrap(values: Sequence[float]) -> Interval:
    """Mean of values, and its percentile interval: Efron, "Bootstrap methods" (1979). The same draws each time."""
    if not len(values):
        return float("nan"), float("nan"), float("nan")
    array = np.asarray(values, dtype=np.float64)
    means = array[np.random.default_rng(0).integers(len(array), size=(DRAWS, len(array)))].mean(axis=1)
    low, high = np.quantile(means, [(1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0])
    return float(array.mean()), float(low), float(high)


def by_explorer(episodes: Sequence[Episode]) -> dict[str, list[Episode]]:
    """Episodes in groups, in the order in which they come."""
    groups: dict[str, list[Episode]] = {}
    for episode in episodes:
        groups.setdefault(episode.explorer, []).append(episode)
    return groups


def row(explorer: str, episodes: Sequence[Episode], wrong: Sequence[Episode] = ()) -> list[str]:
    """One explorer's line, see `HEADS`; errors of pose and map are those of the episodes `wrong`, whose poses are not the truth."""
    cells = [explorer, _told(bootstrap([100 * e.coverage for e in episodes]))]
    cells.append(_told(bootstrap([100 * e.area_under_curve for e in episodes])))
    for mark in MARKS:
        reached = [e.marks[mark] for e in episodes if mark in e.marks]
        way, time = bootstrap([path for path, _ in reached]), bootstrap([seconds for _, seconds in reached])
        cells.append(f"{_told(way)} m, {time[0]:.0f} s ({len(reached)}/{len(episodes)})" if reached else f"(0/{len(episodes)})")
    cells.append(f"{np.mean([e.collisions for e in episodes]):.2f}")
    cells.append(f"{np.median([e.decision_ms for e in episodes]):.1f}")
    for values in ([e.pose_error for e in wrong], [e.iou for e in wrong]):
        known = [100.0 * value for value in values if value is not None]
        cells.append(_told(bootstrap(known)) if known else "")
    return cells


def markdown(rows: Sequence[Sequence[str]]) -> str:
    """The table as a page has it."""
    lines = [HEADS, ["---"] * len(HEADS), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def draw_curves(groups: dict[str, list[Episode]], out: Path) -> None:
    """Mean coverage over the time, with the bootstrap's interval around it."""
    figure = Figure(figsize=(10, 6), dpi=110, layout="constrained")
    axes = figure.subplots()
    for number, (name, episodes) in enumerate(groups.items()):
        curves: NDArray[np.float64] = 100.0 * np.array([episode.curve for episode in episodes])
        draws = np.random.default_rng(0).integers(len(curves), size=(200, len(curves)))
        low, high = np.quantile(curves[draws].mean(axis=1), [0.025, 0.975], axis=0)
        seconds = np.arange(curves.shape[1])
        axes.plot(seconds, curves.mean(axis=0), label=name, color=f"C{number}", linewidth=2.0)
        axes.fill_between(seconds, low, high, color=f"C{number}", alpha=0.15, linewidth=0.0)
    axes.set(xlabel="time [s]", ylabel="area seen [%]", ylim=(0.0, 101.0), xlim=(0.0, seconds[-1]))
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right", ncols=2)
    figure.savefig(out)


def _told(interval: Interval) -> str:
    return "{:.1f} [{:.1f}, {:.1f}]".format(*interval)
