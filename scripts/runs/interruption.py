"""Ctrl-C and SIGTERM between two steps of a run, never within one."""

from __future__ import annotations

import signal
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def interruptible() -> Generator[Callable[[], bool], None, None]:
    """Yield a function that says whether a signal has come. The second one raises KeyboardInterrupt where it strikes.

    The first is only remembered: map, log and recording are not left in the middle of a change.
    """
    asked = False

    def ask(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        if asked:
            raise KeyboardInterrupt
        asked = True

    before = {number: signal.signal(number, ask) for number in SIGNALS}
    try:
        yield lambda: asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
