"""A progress bar with the real-time factor."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from hardware.hal import Recorded, Robot

COLUMNS = (
    TextColumn("{task.fields[now]:7.1f} s"),
    BarColumn(40),
    TextColumn("{task.fields[speed]:5.1f} x real time"),
    TimeRemainingColumn(),
)


@contextmanager
def progress_bar(robot: Robot, duration: float) -> Generator[Callable[[float], None], None, None]:
    """Yield a function to be told the run's time since its start [s]; silent where there is no terminal."""
    span = robot.span[1] - robot.span[0] if isinstance(robot, Recorded) else math.inf
    total = min(duration, span)
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda now: None
        return
    with Progress(*COLUMNS, console=console, transient=True) as bars:
        task = bars.add_task("run", total=total if math.isfinite(total) else None, now=0.0, speed=0.0)
        began = time.perf_counter()

        def advance(now: float) -> None:
            bars.update(task, completed=now, now=now, speed=now / max(time.perf_counter() - began, 1e-6))

        yield advance
