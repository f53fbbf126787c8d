"""What the EV3's firmware does with its motors: unlimited, timed and stepped moves, alone and in pairs (lms2012, d_pwm.c)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Protocol

LEAST_UP, LEAST_DOWN = 6, 4
"""Slowest speed of a ramp up and down [%]."""
COUPLING = 0.5
"""How much a motor that is ahead of its partner is slowed down [% / deg]."""


class Chassis(Protocol):
    """What the brick sits on."""

    def now(self) -> float:
        """Time [s]."""
        ...

    def motors(self) -> tuple[int, ...]:
        """Outputs with a large motor (A is 0)."""
        ...

    def angle_deg(self, output: int) -> float:
        """How far a motor has turned (A is 0)."""
        ...

    def turn(self, output: int, percent: float) -> None:
        """Regulate a motor to a speed, -100 to 100; 0 brakes. The stock firmware knows whole percent only."""
        ...

    def release(self, output: int) -> None:
        """Let a motor float."""
        ...


@dataclass
class Move:
    """A move with an end: ramps and the part between them, in seconds or in degrees."""

    percent: int
    parts: tuple[float, float, float]
    timed: bool
    brake: bool
    begin: float = 0.0
    """Time [s] or count [deg] at which it began."""
    partners: list[Motor] = field(default_factory=list["Motor"])
    """Both motors of a pair."""


class Motor:
    """One output."""

    def __init__(self, output: int, chassis: Chassis) -> None:
        self._output = output
        self._chassis = chassis
        self._zero = self._count()
        self._limited_zero = self._zero
        self.speed = 0
        """What OUTPUT_SPEED has set, for OUTPUT_START [%]."""
        self.polarity = 1
        self.move: Move | None = None
        self.endless = False
        """It runs without an end."""

    @property
    def count(self) -> int:
        """Position since the last CLR_COUNT [deg]."""
        return self._count() - self._zero

    @property
    def limited_count(self) -> int:
        """What OUTPUT_READ returns: zero while no move with an end runs, the firmware clears it at every tick."""
        return 0 if self.move is None else self._count() - self._limited_zero

    def clear(self) -> None:
        """CLR_COUNT."""
        self._zero = self._count()

    def set_speed(self, percent: int) -> None:
        """OUTPUT_SPEED: it takes effect at once on a motor that runs without an end."""
        self.speed = percent
        if self.endless:
            self._drive(percent)

    def start(self) -> None:
        """OUTPUT_START: run without an end; a move goes on."""
        if self.move is None:
            self.endless = self.speed != 0
            self._drive(self.speed)

    def stop(self, brake: bool) -> None:
        """Brake or float."""
        self.move, self.endless = None, False
        if brake:
            self._drive(0)
        else:
            self._chassis.release(self._output)

    def begin(self, move: Move) -> None:
        """Start a move with an end; its `begin` is set here."""
        move.begin = self._chassis.now() if move.timed else self._count()
        self._limited_zero = self._count()
        self.move, self.endless = move, False
        self.tick()

    def tick(self) -> None:
        """Go on with a move."""
        move = self.move
        if move is None:
            return
        done = self._chassis.now() - move.begin if move.timed else abs(self._count() - move.begin)
        if done >= sum(move.parts) and sum(move.parts) > 0.0:
            self.stop(move.brake)
            return
        self._drive(self._level(move, done))

    def progress(self) -> float:
        """Degrees of the current move for each percent of its speed."""
        move = self.move
        return 0.0 if move is None or move.percent == 0 else abs(self._count() - self._limited_zero) / abs(move.percent)

    def _level(self, move: Move, done: float) -> int:
        up, const, down = move.parts
        level = float(abs(move.percent))
        if done < up:
            level = max(level * done / up, LEAST_UP)
        elif down > 0.0 and done > up + const:
            level = max(level * (up + const + down - done) / down, LEAST_DOWN)
        level = min(level, abs(move.percent))
        if move.partners:
            ahead = (self.progress() - min(partner.progress() for partner in move.partners)) * abs(move.percent)
            level = max(level - COUPLING * ahead, 0.0)
        return round(math.copysign(level, move.percent))

    def _drive(self, percent: int) -> None:
        self._chassis.turn(self._output, self.polarity * max(-100, min(100, percent)))

    def _count(self) -> int:
        return math.floor(self._chassis.angle_deg(self._output) + 0.5)


def synchronise(first: Motor, second: Motor, turn: int, move: Move) -> None:
    """STEP_SYNC and TIME_SYNC of two motors in the order of their letters: both make `move`; without a length it has no end.

    With `turn` 0 both run at its speed, at 100 the second one stands, at 200 it runs backwards; negative: the first one.
    """
    shares = (1.0, (100 - turn) / 100) if turn >= 0 else ((100 + turn) / 100, 1.0)
    length, pair = move.parts[1], list[Motor]()
    for motor, share in zip((first, second), shares, strict=True):
        percent = round(move.percent * share)
        if percent == 0:
            motor.stop(brake=True)
            continue
        part = (length if move.timed else length * abs(share)) or math.inf
        motor.begin(replace(move, percent=percent, parts=(0.0, part, 0.0), partners=pair))
        pair.append(motor)
