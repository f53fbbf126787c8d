"""Numba kernels of how people walk: the parts of a body as a function of the way walked and the speed."""

from __future__ import annotations

import numpy as np

from sim.figure import (
    ANKLE,
    ARM,
    FOOT,
    FOREARM,
    HIP,
    HIP_ASIDE,
    KNEE,
    LOWER_ARM,
    MIDDLES,
    PARTS,
    SHANK,
    SHOULDER,
    SHOULDER_ASIDE,
    THIGH,
    TRUNK,
    UPPER_ARM,
)
from slam.kernels.jit import njit
from slam.se2 import FloatArray

STANCE = 0.55
"""Share of a stride that a foot is on the floor."""
REACH = 0.99
"""Share of its length that a leg is stretched to at most: a straight knee would lock."""
FULL_STEPS = 0.4
"""Share of the speed from which on steps are full; shorter ones slide a little."""
LIFT = 0.045
"""How high the ankle rises in the swing, as a share of the height."""
TOE_DOWN = 0.4
"""Most turn of the swinging foot [rad]."""
ARM_SWING, ELBOW = 0.9, 0.25
"""Swing of an arm over the swing of the leg on its other side; bend of the elbow [rad]."""
TRUNK_Z, FOREARM_Z = MIDDLES[TRUNK], LOWER_ARM / 2
COLUMNS = 5
"""Of a walk's table: x, y [m], heading [rad], way walked [m], speed as a share of the person's own."""


@njit
def clocks_at(clocks: FloatArray, last: int, places: tuple[float, float], count: int) -> FloatArray:
    """Clocks and their rates (M, count, 2) interpolated between ticks, at places among these.

    Args:
        clocks: (>= last + 1, M, 2) at each tick.
        last: tick that is known last.
        places: the first one and from one to the next [ticks].
        count: number of places.
    """
    found = np.empty((clocks.shape[1], count, 2))
    for n in range(count):
        place = min(max(places[0] + n * places[1], 0.0), float(last))
        k = min(int(place), max(last - 1, 0))
        for i in range(clocks.shape[1]):
            for j in range(2):
                found[i, n, j] = clocks[k, i, j] + (place - k) * (clocks[k + 1, i, j] - clocks[k, i, j])
    return found


@njit
def states(table: FloatArray, tick: float, clocks: FloatArray) -> FloatArray:
    """Rows (K, 5) of a walk at times on the person's own clock.

    Args:
        table: (N, 5) one round, a row every `tick`, the last where the first is, but for whole turns and the way walked.
        tick: time between rows [s].
        clocks: (K, 2) time on the person's clock [s] and how fast it runs, below 0: backwards.
    """
    rows = np.empty((len(clocks), COLUMNS))
    ticks = len(table) - 1
    for k in range(len(clocks)):
        place = clocks[k, 0] / tick
        rounds = np.floor(place / ticks)
        place -= rounds * ticks
        i = min(int(place), ticks - 1)
        f = place - i
        for j in range(COLUMNS):
            rows[k, j] = table[i, j] + f * (table[i + 1, j] - table[i, j])
        rows[k, 3] += rounds * (table[ticks, 3] - table[0, 3])
        rows[k, 4] *= min(abs(clocks[k, 1]), 1.0)
    return rows


@njit
def walk(table: FloatArray, tick: float, clocks: FloatArray, height: float, step: float) -> FloatArray:
    """`poses` of the `states` at clocks (K, 2)."""
    return poses(states(table, tick, clocks), height, step)


@njit
def poses(rows: FloatArray, height: float, step: float) -> FloatArray:
    """Frames (11, K, 12) of a body's parts in the world: rotation row by row, position [m].

    Args:
        rows: (K, 5) see `states`.
        height: of the person [m].
        step: way from one footfall to the next at the person's own speed [m].
    """
    frames = np.empty((PARTS, len(rows), 12))
    legs = np.empty((2, 4))  # ankle ahead of the hip, its height, swing of the foot, height that the leg allows the hip
    length = (HIP - ANKLE) * height
    stand = np.empty(4)  # x, y, cosine and sine of the heading
    for k in range(len(rows)):
        stand[:] = rows[k, 0], rows[k, 1], np.cos(rows[k, 2]), np.sin(rows[k, 2])
        amplitude = min(rows[k, 4] / FULL_STEPS, 1.0)
        for side in range(2):
            share = (rows[k, 3] / (2.0 * step) + 0.5 * side + 0.25) % 1.0
            ahead, swing = _ankle(share)
            x, z = amplitude * step * ahead, (ANKLE + LIFT * amplitude * np.sin(np.pi * swing)) * height
            legs[side, 0], legs[side, 1] = x, z
            legs[side, 2] = -TOE_DOWN * amplitude * np.sin(np.pi * swing) * (1.0 - swing)
            legs[side, 3] = z + np.sqrt((REACH * length) ** 2 - x * x)
        hip = min(legs[0, 3], legs[1, 3])
        _place(frames[TRUNK, k], stand, (0.0, 0.0, hip + (TRUNK_Z - HIP) * height), 0.0)
        for side in range(2):
            _leg(frames, k, stand, legs[side], (float(side), hip, height))
            _arm(frames, k, stand, legs[1 - side, 0] / length, (float(side), hip, height))
    return frames


@njit
def _ankle(share: float) -> tuple[float, float]:
    """Ankle ahead of the hip in steps, and how far its swing is, 0 to 1, at a share of the stride: it stands still on the floor."""
    if share < STANCE:
        return STANCE - 2.0 * share, 0.0
    swing = (share - STANCE) / (1.0 - STANCE)
    return STANCE * (2.0 * swing * swing * (3.0 - 2.0 * swing) - 1.0), swing


@njit
def _leg(frames: FloatArray, k: int, stand: FloatArray, leg: FloatArray, body: tuple[float, float, float]) -> None:
    """Thigh, shank and foot by the law of cosines; the knee bends forward."""
    side, hip, height = int(body[0]), body[1], body[2]
    thigh, shank = (HIP - KNEE) * height, (KNEE - ANKLE) * height
    y = HIP_ASIDE * height * (1.0 - 2.0 * side)
    x, down = leg[0], hip - leg[1]
    d = np.sqrt(x * x + down * down)
    bend = np.arccos(min((thigh * thigh + d * d - shank * shank) / (2.0 * thigh * d), 1.0))
    upper = np.arctan2(x, down) + bend
    knee_x, knee_z = thigh * np.sin(upper), hip - thigh * np.cos(upper)
    lower = np.arctan2(x - knee_x, knee_z - leg[1])
    _place(frames[THIGH + side, k], stand, (0.5 * knee_x, y, 0.5 * (hip + knee_z)), upper)
    _place(frames[SHANK + side, k], stand, (0.5 * (knee_x + x), y, 0.5 * (knee_z + leg[1])), lower)
    _place(frames[FOOT + side, k], stand, (x, y, leg[1]), leg[2])


@njit
def _arm(frames: FloatArray, k: int, stand: FloatArray, leg_swing: float, body: tuple[float, float, float]) -> None:
    """Upper arm and forearm, which swing with the leg on the other side."""
    side, hip, height = int(body[0]), body[1], body[2]
    y = SHOULDER_ASIDE * height * (1.0 - 2.0 * side)
    shoulder = hip + (SHOULDER - HIP) * height
    upper = ARM_SWING * leg_swing
    lower = upper + ELBOW + max(0.6 * leg_swing, 0.0)
    reach, half = UPPER_ARM * height, FOREARM_Z * height
    _place(frames[ARM + side, k], stand, (0.5 * reach * np.sin(upper), y, shoulder - 0.5 * reach * np.cos(upper)), upper)
    elbow_x, elbow_z = reach * np.sin(upper), shoulder - reach * np.cos(upper)
    _place(frames[FOREARM + side, k], stand, (elbow_x + half * np.sin(lower), y, elbow_z - half * np.cos(lower)), lower)


@njit
def _place(frame: FloatArray, stand: FloatArray, p: tuple[float, float, float], swing: float) -> None:
    """Frame of a part at `p` in the person's frame, whose lower end has swung forward by `swing` [rad]."""
    c, s, a, b = stand[2], stand[3], np.cos(swing), np.sin(swing)
    frame[0], frame[1], frame[2] = c * a, -s, -c * b
    frame[3], frame[4], frame[5] = s * a, c, -s * b
    frame[6], frame[7], frame[8] = b, 0.0, a
    frame[9], frame[10], frame[11] = stand[0] + c * p[0] - s * p[1], stand[1] + s * p[0] + c * p[1], p[2]
