"""Minutes of faults on every driver: cut and disturbed answers, silence, a plug that is pulled and put back."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

from hardware.drivers.errors import DeviceError
from scripts.bench.row import Row
from scripts.bench.wire import SMOKE
from scripts.bench.wire.brick_trial import BrickTrial
from scripts.bench.wire.camera_trial import CameraTrial
from scripts.bench.wire.lidar_trial import LidarTrial
from scripts.bench.wire.trial import Trial

LASTS = 600.0
"""For so long faults befall each driver [s]."""
SHORTEST, LONGEST = 0.1, 1.5
"""Of a fault [s]."""
REST = 0.5
"""Between two faults [s]."""
PATIENCE = 10.0
"""A driver that is not back after so long is not waited for [s]."""
LOOK = 0.02
"""Between two looks at what the driver says [s]."""
KINDS = ("cut", "garbage", "silence", "unplug")


@dataclass
class Ordeal:
    """What has befallen a driver."""

    trial: Trial
    rng: random.Random
    count: int = 0
    worst: dict[str, float] = field(default_factory=lambda: dict.fromkeys(KINDS, 0.0))
    """Longest time from the end of a fault to the first true reading, by the kind of the fault [s]."""

    def befall(self) -> None:
        """One fault, and the way back."""
        kind, port = self.rng.choice(KINDS), self.trial.port
        if kind == "unplug":
            port.unplug()
        elif kind == "silence":
            port.silent = True
        else:
            port.disturbed = self._cut if kind == "cut" else self._garbage
        end = time.monotonic() + self.rng.uniform(SHORTEST, LONGEST)
        self._watch(lambda: time.monotonic() > end)
        port.silent, port.disturbed = False, bytes
        port.replug()
        whole = time.monotonic()
        self._watch(lambda: self.trial.newest > whole or time.monotonic() > whole + PATIENCE)
        self.worst[kind] = max(self.worst[kind], time.monotonic() - whole)
        self.count += 1
        rested = time.monotonic() + REST
        self._watch(lambda: time.monotonic() > rested)

    def _watch(self, done: Callable[[], bool]) -> None:
        while not done():
            self.trial.look()
            time.sleep(LOOK)

    def _cut(self, answer: bytes) -> bytes:
        return answer[: self.rng.randrange(len(answer))]

    def _garbage(self, answer: bytes) -> bytes:
        noise = self.rng.randbytes(self.rng.randrange(1, 64))
        return self.rng.choice((noise, noise + answer, answer + noise))


def run(smoke: bool) -> Iterator[Row]:
    """Of the brick with stock firmware and with ev3dev, of the lidar, and of the camera where its vendor's library is."""
    trials = BrickTrial("EV3, TCP"), BrickTrial("ev3dev"), LidarTrial(), CameraTrial()
    return run_each(trials, SMOKE if smoke else LASTS)


def run_each(trials: Iterable[Trial], seconds: float) -> Iterator[Row]:
    """Of one driver after the other, each for so long [s]; of one that does not open a row says why."""
    for trial in trials:
        try:
            yield from rows(trial, seconds)
        except DeviceError as error:
            yield Row("wire", f"{trial.name}: not measured, {error}", math.nan, "")


def rows(trial: Trial, seconds: float) -> list[Row]:
    """Of one driver, for so long [s].

    Raises:
        DeviceError: it does not open.
    """
    with trial:
        ordeal, end = Ordeal(trial, random.Random(trial.name)), time.monotonic() + seconds
        while time.monotonic() < end:
            ordeal.befall()
    replug = ordeal.worst.pop("unplug")
    what = f"{trial.name}: {ordeal.count} faults in {seconds / 60.0:.3g} min"
    return [
        Row("wire", f"{what}, wrong readings", trial.wrong, "", "0"),
        Row("wire", f"{what}, longest time from replug to a reading", replug, "s", "≤ 2"),
        Row("wire", f"{what}, longest time from the end of another fault", max(ordeal.worst.values()), "s"),
    ]
