"""The one door to Numba. Kernels compile lazily on first use and are cached on disk (eager signatures reject read-only arrays)."""

from __future__ import annotations

import fcntl
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import FunctionCache

F = TypeVar("F", bound=Callable[..., Any])


class SharedCache(FunctionCache):
    """Numba's cache of one kernel, for processes that compile at the same time.

    Numba writes the index of a kernel's versions and the versions themselves one after the other: two processes that do so together
    leave an index that names the other one's code, which every later run then loads.
    """

    def load_overload(self, sig: object, target_context: object) -> object:
        """The compiled version for a signature, or None."""
        with self._alone():
            return super().load_overload(sig, target_context)

    def save_overload(self, sig: object, data: object) -> None:
        """Keep a compiled version."""
        with self._alone():
            super().save_overload(sig, data)

    @contextmanager
    def _alone(self) -> Generator[None]:
        """No other process is at the kernels of this folder."""
        with Path(self.cache_path, "kernels.lock").open("ab") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield


def njit(function: F) -> F:
    """Compile a kernel: no Python objects, no threads, no relaxed floating point (the same bits on every run)."""
    return _cached(function)


def inlined(function: F) -> F:
    """As `njit`, for the inside of a hot loop: part of every kernel that calls it, not a call."""
    return _cached(function, forceinline=True)


def contracted(function: F) -> F:
    """As `njit`, but a product and a sum may be rounded once: faster, and the same bits on every run of one kind of processor."""
    return _cached(function, fastmath={"contract"})


def _cached(function: F, **options: Any) -> F:  # noqa: ANN401 (Numba's own)
    dispatcher = cast(Any, numba.njit(nogil=True, error_model="numpy", **options)(function))
    dispatcher._cache = SharedCache(function)  # what its `enable_caching` does
    return cast(F, dispatcher)
