"""Work shared among processes of this machine."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

Work = TypeVar("Work")
Result = TypeVar("Result")


def spread(do: Callable[[Work], Result], work: Sequence[Work], processes: int) -> Iterator[Result]:
    """Results in the order of the work, whoever does it.

    Args:
        do: must be importable by a fresh process.
        work: what is done; at most one process for each.
        processes: that run at the same time; 0: one for each processor, 1: this one.
    """
    count = min(processes or multiprocessing.cpu_count(), len(work))
    if count <= 1:
        yield from map(do, work)
        return
    with multiprocessing.get_context("spawn").Pool(count) as pool:
        yield from pool.imap(do, work)
