"""Particles in two threads, where kernels that hold no lock do the work."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

_POOL = ThreadPoolExecutor(2, "particles")
WORTH_IT = 8
"""Fewest particles that are worth a second thread."""


def side_by_side(work: Callable[[slice], None], count: int) -> None:
    """Do the work on the two halves of so many particles at once: which thread is first must not matter."""
    middle = count // 2 if count >= WORTH_IT else count
    list(_POOL.map(work, [slice(0, middle), slice(middle, count)]))
