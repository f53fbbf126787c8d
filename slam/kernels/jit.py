"""The one door to Numba. Kernels compile lazily on first use and are cached on disk (eager signatures reject read-only arrays)."""

from __future__ import annotations

import fcntl
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.compiler_lock import global_compiler_lock

F = TypeVar("F", bound=Callable[..., Any])
_compiled = partial(numba.njit, cache=True, nogil=True, error_model="numpy")


def njit(function: F) -> F:
    """Compile a kernel: no Python objects, no threads, no relaxed floating point (the same bits on every run)."""
    return _cached(function, _compiled())


def inlined(function: F) -> F:
    """As `njit`, for the inside of a hot loop: part of every kernel that calls it, not a call."""
    return _cached(function, _compiled(forceinline=True))


def contracted(function: F) -> F:
    """As `njit`, but a product and a sum may be rounded once: faster, and the same bits on every run of one kind of processor."""
    return _cached(function, _compiled(fastmath={"contract"}))


def _cached(function: F, compiled: Callable[[F], object]) -> F:
    dispatcher = cast(Any, compiled(function))
    lock = Path(dispatcher.stats.cache_path, f"{function.__module__}.{function.__name__}.lock")
    dispatcher.compile = _by_one_process(dispatcher.compile, lock)
    return cast(F, dispatcher)


def _by_one_process(compile_kernel: Callable[[object], object], lock: Path) -> Callable[[object], object]:
    """A kernel's `compile`, for processes that need it at the same time: one compiles, the others wait and load what it has kept.

    Without it they all compile. And Numba writes the index of a kernel's versions and the versions themselves one after the other: two
    processes that do so together leave an index that names the other one's code, which every later run then loads.
    """

    def compile_alone(signature: object) -> object:
        with global_compiler_lock, lock.open("ab") as held:  # the threads' lock first: who has it meets locks in the order of calls
            fcntl.flock(held, fcntl.LOCK_EX)
            return compile_kernel(signature)

    return compile_alone
