"""The order of explorers, and whether two robots give the same."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from scripts.evaluation.episode import Episode
from scripts.evaluation.statistics import Interval, bootstrap, by_explorer

HEADS = ("explorer", "AUC [%]", "rank", "AUC [%]", "rank")
Scores = dict[str, Interval]
"""Explorer -> mean area under the curve of coverage [%] and the ends of its interval."""


def scores(episodes: Sequence[Episode]) -> Scores:
    """Of all explorers."""
    return {name: bootstrap([100.0 * e.area_under_curve for e in group]) for name, group in by_explorer(episodes).items()}


def rank(name: str, among: Scores) -> int:
    """1 and how many are better beyond doubt: overlapping intervals are a tie."""
    return 1 + sum(low > among[name][2] for _, low, _ in among.values())


def reversals(one: Scores, other: Scores) -> list[tuple[str, str]]:
    """Pairs (a, b) of which a is better in the one and b in the other, both beyond doubt."""
    pairs = itertools.permutations(one, 2)
    return [(a, b) for a, b in pairs if one[a][1] > one[b][2] and other[b][1] > other[a][2]]


def rows(one: Scores, other: Scores) -> list[list[str]]:
    """A line for each explorer, the best of `one` first, see `HEADS`."""
    told = [{name: ("{:.1f} [{:.1f}, {:.1f}]".format(*among[name]), str(rank(name, among))) for name in one} for among in (one, other)]
    return [[name, *told[0][name], *told[1][name]] for name in sorted(one, key=lambda name: -one[name][0])]


def verdict(one: Scores, other: Scores) -> str:
    """Whether both give the same order, in a sentence."""
    pairs = reversals(one, other)
    if not pairs:
        return "the same order: no two explorers change places beyond their intervals"
    return "not the same order: " + "; ".join(f"{a} is better than {b} by the first alone, and worse by the second" for a, b in pairs)
