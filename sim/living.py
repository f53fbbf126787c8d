"""What the clock moves in a world, people and swinging doors, and how it waits for the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim import gait, living_kernel
from sim.doors import Leaf
from sim.figure import Part
from sim.motion import STEP, Frames
from sim.people import TICK as WALK_TICK
from sim.people import Walker
from slam.se2 import SE2, FloatArray
from worlds.world import World

TICK_STEPS = 10
"""Physics steps between two looks at the robot."""
TICK = TICK_STEPS * STEP
FORESIGHT = (0.25, 0.5)
"""How far ahead they look for the robot on their way [s]."""
KEPT_OFF = 0.4
"""Who would come nearer to the middle of the robot than this waits [m]."""
BRAKING = 4.0
"""How fast their clocks slow down and speed up again [1/s]."""
PATIENCE = 3.0
"""Who has waited for so long steps back [s]."""
STEPPING_BACK = -0.4
"""Rate of the clock of one who steps back."""
SAMPLES = 0.01
"""Time between the frames that a sweep or an exposure is interpolated from, at most [s]."""
EVERYWHERE = (0.0, 0.0, math.inf)
LOOKED_THROUGH = 20.0
"""Beginning of a mover's time that tells how high its parts come [s]."""


class Mover(Protocol):
    """Something whose parts are where its own clock says."""

    @property
    def parts(self) -> Sequence[Part]:
        """Its rigid parts."""
        ...

    def frames(self, clocks: FloatArray) -> FloatArray:
        """T_world_part as rotation row by row and position, (parts, K, 12), at clocks (K, 2): time [s] and its rate."""
        ...

    def distances(self, clocks: FloatArray, x: float, y: float) -> FloatArray:
        """How far it is from a place (K,) [m] at clocks (K, 2)."""
        ...


class Living:
    """The people and the swinging doors of a world. Each has a clock of its own, which runs with time unless the robot is in the way.

    `tick` decides the clocks up to the next one; whatever is asked of until then, or of the past, is a function of time.
    """

    def __init__(self, world: World, began: float = 0.0) -> None:
        """All clocks say `began` [s] at time zero."""
        self.walkers = [Walker(person) for person in world.people]
        self._movers: list[Mover] = [*self.walkers, *(Leaf(door) for door in world.doors if door.state == "swinging")]
        self.parts: list[Part] = [part for mover in self._movers for part in mover.parts]
        """The parts of all, one mover after the other; what is known of them has the same order."""
        tables = [np.empty((0, gait.COLUMNS)), *(walker.table for walker in self.walkers)]
        bodies = [(walker.person.height, walker.step) for walker in self.walkers]
        self._walks = np.concatenate(tables), np.cumsum([len(table) for table in tables]), np.array(bodies).reshape(-1, 2)
        self._clocks = np.zeros((1 << 10, len(self._movers), 2))
        self._clocks[0] = began, 1.0
        self._ticks = 0
        self._waited = [0.0] * len(self._movers)

    @property
    def now(self) -> float:
        """When the present tick began [s]."""
        return max(self._ticks - 1, 0) * TICK

    @property
    def persons(self) -> NDArray[np.int64]:
        """Number of the person that each part belongs to (P,), as in `World.people`; -1: a door's."""
        numbers = [k if k < len(self.walkers) else -1 for k, mover in enumerate(self._movers) for _ in mover.parts]
        return np.array(numbers, dtype=np.int64)

    def tick(self, step: int, x: float, y: float) -> None:
        """Begin a tick if one begins at physics step `step`, when the robot is at a place [m]."""
        if step < self._ticks * TICK_STEPS:
            return
        if self._ticks + 1 == len(self._clocks):
            self._clocks = np.concatenate([self._clocks, np.zeros_like(self._clocks)])
        for i, mover in enumerate(self._movers):
            clock, rate = self._clocks[self._ticks, i].tolist()
            change = self._wanted_rate(i, mover, clock, (x, y)) - rate
            next_rate = rate + min(max(change, -BRAKING * TICK), BRAKING * TICK)
            self._clocks[self._ticks + 1, i] = clock + 0.5 * (rate + next_rate) * TICK, next_rate
        self._ticks += 1

    def frames(self, start: float, end: float, near: tuple[float, float, float] = EVERYWHERE) -> Frames:
        """Frames of all parts (P, K, 12), K at least 2, from `start` to `end` [s], none later than the next tick.

        Who is farther from a place (x, y) than a distance [m] at the start, `near`, may be left infinitely far away.
        """
        count = max(math.ceil((end - start) / SAMPLES), 1) + 1
        step = max(end - start, 1e-6) / (count - 1)
        clocks = gait.clocks_at(self._clocks, self._ticks, (start / TICK, step / TICK), count)
        people = living_kernel.frames(self._walks, WALK_TICK, clocks, near)
        leaves = [leaf.frames(clocks[i]) for i, leaf in enumerate(self._movers[len(self.walkers) :], len(self.walkers))]
        return Frames(np.concatenate([people, *leaves]) if leaves else people, start, step)

    def people(self, t: float) -> tuple[SE2, ...]:
        """T_world_person of everybody at time `t` [s]: where they stand, x forward."""
        clocks = gait.clocks_at(self._clocks, self._ticks, (t / TICK, 0.0), 1)[:, 0, 0].tolist()
        return tuple(walker.pose(clock) for walker, clock in zip(self.walkers, clocks, strict=False))

    def parts_between(self, low: float, high: float) -> list[int]:
        """Numbers of the parts that come between two heights [m] while their movers move."""
        clocks = np.column_stack([np.linspace(0.0, LOOKED_THROUGH, 400), np.ones(400)])
        frames = [frame for mover in self._movers for frame in mover.frames(clocks)]
        spans = [_heights(part, frame) for part, frame in zip(self.parts, frames, strict=True)]
        return [k for k, (lowest, highest) in enumerate(spans) if lowest <= high and highest >= low]

    def _wanted_rate(self, i: int, mover: Mover, clock: float, robot: tuple[float, float]) -> float:
        clocks = np.array([[clock + ahead, 1.0] for ahead in (0.0, *FORESIGHT)])
        now, *ahead = mover.distances(clocks, *robot).tolist()
        if min(ahead) >= min(KEPT_OFF, now - 1e-4):
            self._waited[i] = 0.0
            return 1.0
        self._waited[i] += TICK
        return STEPPING_BACK if self._waited[i] > PATIENCE and i < len(self.walkers) else 0.0


def until_tick(step: int) -> int:
    """Physics steps from `step` to the next tick."""
    return TICK_STEPS - step % TICK_STEPS


def _heights(part: Part, frames: FloatArray) -> tuple[float, float]:
    """Lowest and highest z [m] of a part in frames (K, 12)."""
    corners = part.triangles.reshape(-1, 3)
    z = frames[:, 6:9] @ np.unique(corners, axis=0).T + frames[:, 11:12]
    return float(z.min()), float(z.max())
