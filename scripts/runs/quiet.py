"""Libraries that greet on the terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Generator
from contextlib import contextmanager


@contextmanager
def quiet_import() -> Generator[None, None, None]:
    """Keep what a library written in C says on stderr while it is imported (PyBullet: its build time) from the user."""
    if sys.stderr is None:
        yield
        return
    sys.stderr.flush()
    held = os.dup(2)
    with open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(held, 2)
        os.close(held)
