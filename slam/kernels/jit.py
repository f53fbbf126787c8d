"""The one door to Numba. Kernels compile lazily on first use and are cached on disk (eager signatures reject read-only arrays)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])


def njit(function: F) -> F:
    """Compile a kernel: no Python objects, no threads, no relaxed floating point (the same bits on every run)."""
    return cast(F, numba.njit(cache=True, nogil=True, error_model="numpy")(function))


def inlined(function: F) -> F:
    """As `njit`, for the inside of a hot loop: part of every kernel that calls it, not a call."""
    return cast(F, numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)(function))


def contracted(function: F) -> F:
    """As `njit`, but a product and a sum may be rounded once: faster, and the same bits on every run of one kind of processor."""
    return cast(F, numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})(function))
