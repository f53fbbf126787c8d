"""Particles in bins of x, y and yaw: how many there are, and which hang together. Bins are found by an open hash table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Sizes = tuple[float, float]
"""Of a bin along x and y [m], in yaw [rad]; a whole number of the latter makes a turn."""
EMPTY = -1
HASH = 0x2545F4914F6CDD1D
"""An odd number whose upper bits mix all bits of a key."""
FIRST = 64
"""Slots of a new table."""
SIDE = 1 << 20
"""Bins to each side of the origin along x and y; beyond them they are taken for others."""


@njit
def fill(poses: NDArray[np.float64], sizes: Sizes) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The bin of every pose (N, 3), numbered as they first appear, (N,), and the bins' places (K, 3) in x, y and yaw.

    Args:
        poses: x, y [m], yaw [rad].
        sizes: of the bins.
    """
    turn, per_side = np.round(2.0 * np.pi / sizes[1]), 1.0 / sizes[0]
    per_angle, per_turn = 1.0 / sizes[1], 1.0 / turn
    bins = np.empty(len(poses), np.int64)
    for n in range(len(poses)):  # without a branch: several at once
        k = np.floor(poses[n, 2] * per_angle)
        k -= turn * np.floor((k + 0.5) * per_turn)
        bins[n] = _key(int(np.floor(poses[n, 0] * per_side)), int(np.floor(poses[n, 1] * per_side)), int(k))
    slots, known = _larger(bins[:0])
    n, count = _number(bins, 0, slots, known, 0)
    while n < len(bins):
        slots, known = _larger(known[:count])
        n, count = _number(bins, n, slots, known, count)
    places = np.empty((count, 3), np.int64)
    for b in range(count):
        places[b, 0], places[b, 1], places[b, 2] = (known[b] >> 40) - SIDE, (known[b] >> 16 & (2 * SIDE - 1)) - SIDE, known[b] & 0xFFFF
    return bins, places


@njit
def _number(bins: NDArray[np.int64], start: int, slots: NDArray[np.int64], known: NDArray[np.int64], count: int) -> tuple[int, int]:
    """Put numbers in the place of keys (N,), from `start` on, until the table is half full; where that was, and how many bins there are.

    A loop of its own: where the table could be replaced in it, the arrays would be counted at every step, four times slower.
    """
    mask = len(slots) - 1
    for n in range(start, len(bins)):
        slot = (bins[n] * HASH >> 32) & mask
        while slots[slot] != EMPTY and known[slots[slot]] != bins[n]:
            slot = (slot + 1) & mask
        if slots[slot] == EMPTY:
            if 2 * count == len(slots):
                return n, count
            slots[slot], known[count] = count, bins[n]
            count += 1
        bins[n] = slots[slot]
    return len(bins), count


@njit
def count_of(bins: NDArray[np.int64], total: int, chosen: NDArray[np.int64]) -> int:
    """How many of the `total` bins (N,) the chosen ones (K,) fill."""
    seen, count = np.zeros(total, np.bool_), 0
    for n in chosen:
        if not seen[bins[n]]:
            seen[bins[n]] = True
            count += 1
    return count


@njit
def connect(places: NDArray[np.int64], turn: int) -> NDArray[np.int64]:
    """Label (K,) of every bin: bins that touch, by a corner too, have the same one; yaw goes round after `turn` bins."""
    count = len(places)
    known = np.empty(count, np.int64)
    for b in range(count):
        known[b] = _key(places[b, 0], places[b, 1], places[b, 2])
    slots, known = _larger(known)
    labels, stack = np.full(count, EMPTY, np.int64), np.empty(count, np.int64)
    for b in range(count):
        if labels[b] != EMPTY:
            continue
        labels[b], stack[0], height = b, b, 1
        while height > 0:
            height -= 1
            place = places[stack[height]]
            for near in range(27):
                i, j, k = place[0] + near // 9 - 1, place[1] + near // 3 % 3 - 1, (place[2] + near % 3 - 1) % turn
                other = slots[_slot(slots, known, _key(i, j, k))]
                if other != EMPTY and labels[other] == EMPTY:
                    labels[other], stack[height] = b, other
                    height += 1
    return labels


@njit
def _key(i: int, j: int, k: int) -> int:
    """One number for a bin."""
    return ((i + SIDE) & (2 * SIDE - 1)) << 40 | ((j + SIDE) & (2 * SIDE - 1)) << 16 | k


@njit
def _slot(slots: NDArray[np.int64], known: NDArray[np.int64], key: int) -> int:
    """Where a bin is in the hash table, or would be."""
    mask = len(slots) - 1
    slot = (key * HASH >> 32) & mask
    while slots[slot] != EMPTY and known[slots[slot]] != key:
        slot = (slot + 1) & mask
    return slot


@njit
def _larger(keys: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """A table of bins with at least four slots for each, and their keys with room for as many."""
    size = FIRST
    while size < 4 * len(keys):
        size *= 2
    slots, known = np.full(size, EMPTY, np.int64), np.empty(size, np.int64)
    for b in range(len(keys)):
        known[b] = keys[b]
        slots[_slot(slots, known, keys[b])] = b
    return slots, known
