"""A person of the world as a body that the clock moves: the round as a table, the parts at any time of the person's own clock."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from sim import gait
from sim.figure import Part, figure
from slam.se2 import SE2, FloatArray, wrap_angle
from worlds.living import Person

TICK = 0.02
"""Time between two rows of a walk's table [s]."""
WALK_RATIO = 0.39
"""Step length over steps a second [m s]: 0.0065 m per step a minute (Sekiya and Nagasaki 1998)."""
ACCELERATION = 1.5
"""Of one who starts or stops walking [m/s^2]."""
TURN_RATE = 2.5
"""Of one who turns on the spot, at most [rad/s]."""
SHARP = math.radians(60.0)
"""Who must turn by more stops for it; others cut the corner."""
CORNER = 0.3
"""How far before a waypoint a corner begins to be cut, at most [m]."""
STANDING = 60.0
"""Length of the round of one who only stands [s]."""

Corner = tuple[FloatArray, float, float]
"""A waypoint (2,) [m], the heading to it and the heading from it [rad]."""


class Walker:
    """A person: where the parts of the body are is a function of the person's clock and of how fast that runs."""

    def __init__(self, person: Person) -> None:
        self.person = person
        self.parts: tuple[Part, ...] = figure(person.height, person.seed)
        self.table = _round(person)
        """Of `gait.states`."""
        self.step = math.sqrt(WALK_RATIO * person.speed)
        """Way from one footfall to the next at the person's own speed [m]."""

    @property
    def period(self) -> float:
        """Of a round on the person's clock [s]."""
        return (len(self.table) - 1) * TICK

    def frames(self, clocks: FloatArray) -> FloatArray:
        """T_world_part of every part as rotation row by row and position, (11, K, 12), at clocks (K, 2): time [s] and its rate."""
        return gait.walk(self.table, TICK, clocks, self.person.height, self.step)

    def pose(self, clock: float) -> SE2:
        """T_world_person at a time of the person's clock [s]: where they stand, x forward."""
        x, y, yaw = gait.states(self.table, TICK, np.array([[clock, 1.0]]))[0, :3].tolist()
        return SE2(x, y, yaw)

    def distances(self, clocks: FloatArray, x: float, y: float) -> FloatArray:
        """How far the middle of the person is from a place (K,) [m] at clocks (K, 2)."""
        rows = gait.states(self.table, TICK, clocks)
        return np.hypot(rows[:, 0] - x, rows[:, 1] - y)


def _round(person: Person) -> FloatArray:
    """The table of `gait.states`: one round from the first waypoint and its pause to the first waypoint."""
    if len(person.path) == 1:
        return np.array([[*person.path[0], 0.0, 0.0, 0.0]] * (round(STANDING / TICK) + 1))
    rows: list[FloatArray] = []
    for row in _rows(person):
        turned = wrap_angle(row[2] - rows[-1][2]) if rows else 0.0
        rows.append(np.array([row[0], row[1], rows[-1][2] + turned if rows else row[2], row[3], row[4]]))
    return np.array(rows)


def _rows(person: Person) -> Iterator[tuple[float, float, float, float, float]]:
    """x, y, heading, way walked, share of the speed, tick by tick."""
    corners = _corners(person)
    walked = 0.0
    stops = [k for k in range(len(corners)) if k == 0 or _stops(person, corners, k)]
    for begin, end in zip(stops, [*stops[1:], len(corners)], strict=True):
        (x, y), before, after = corners[begin]
        turn = wrap_angle(after - before)
        for share in _ticks(max(_pause(person, begin), 1.5 * abs(turn) / TURN_RATE)):
            yield float(x), float(y), before + turn * share * share * (3.0 - 2.0 * share), walked, 0.0
        way = _way([corners[k % len(corners)] for k in range(begin, end + 1)])
        length = float(way[-1, 3])
        for along, share in _speeds(length, person.speed):
            x, y, yaw = (float(np.interp(along, way[:, 3], way[:, j])) for j in range(3))
            yield x, y, yaw, walked + along, share
        walked += length
    (x, y), before, _ = corners[0]
    yield float(x), float(y), before, walked, 0.0


def _corners(person: Person) -> list[Corner]:
    points = np.array(person.path)
    legs = np.roll(points, -1, axis=0) - points
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    return [(point, float(headings[k - 1]), float(headings[k])) for k, point in enumerate(points)]


def _pause(person: Person, waypoint: int) -> float:
    return person.pauses[waypoint] if waypoint < len(person.pauses) else 0.0


def _stops(person: Person, corners: list[Corner], waypoint: int) -> bool:
    _, before, after = corners[waypoint]
    return _pause(person, waypoint) > 0.0 or abs(wrap_angle(after - before)) > SHARP


def _way(corners: list[Corner]) -> FloatArray:
    """x, y, heading, way walked (N, 4) past corners that are cut by parabolas."""
    points = [corners[0][0]]
    for (before, _, _), (corner, _, _), (after, _, _) in zip(corners, corners[1:], corners[2:], strict=False):
        cut = min(CORNER, float(np.linalg.norm(corner - before)) / 2, float(np.linalg.norm(after - corner)) / 2)
        begin, end = corner + cut * _unit(before - corner), corner + cut * _unit(after - corner)
        t = np.linspace(0.0, 1.0, 9)[:, None]
        points.extend((1.0 - t) ** 2 * begin + 2.0 * t * (1.0 - t) * corner + t**2 * end)
    xy = np.array([*points, corners[-1][0]])
    steps = np.diff(xy, axis=0)
    xy = xy[np.concatenate([[True], np.linalg.norm(steps, axis=1) > 1e-9])]
    steps = np.diff(xy, axis=0)
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    middles = np.concatenate([headings[:1], 0.5 * (headings[1:] + headings[:-1]), headings[-1:]])
    return np.column_stack([xy, middles, np.concatenate([[0.0], np.cumsum(np.linalg.norm(steps, axis=1))])])


def _speeds(length: float, speed: float) -> Iterator[tuple[float, float]]:
    """Way walked [m] and share of the speed, tick by tick: speeding up, walking on, slowing down."""
    top = min(speed, math.sqrt(ACCELERATION * length))
    ramp, ramped = top / ACCELERATION, top * top / ACCELERATION
    duration = 2.0 * ramp + (length - ramped) / top
    for share in _ticks(duration):
        t = share * duration
        left = duration - t
        along = top * (t - 0.5 * ramp)
        if t < ramp:
            along = 0.5 * ACCELERATION * t * t
        elif left < ramp:
            along = length - 0.5 * ACCELERATION * left * left
        yield along, min(t, left, ramp) * ACCELERATION / speed


def _ticks(duration: float) -> Iterator[float]:
    """Shares of a duration, a tick apart as near as whole numbers of ticks allow, the end left out."""
    count = max(round(duration / TICK), 1) if duration > 0.0 else 0
    return (k / count for k in range(count))


def _unit(v: FloatArray) -> FloatArray:
    return v / np.linalg.norm(v)
