"""What a lidar would see from everywhere in a map, and where what it sees would fit: for a robot that may be anywhere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.rays import cast

Ranges = NDArray[np.float32]
FINE = 2
"""Fine places and rays to each side that a coarse one pools, so that what is between two of them is covered too."""


@njit
def look_around(
    squares: tuple[NDArray[np.uint8], NDArray[np.uint8]], places: NDArray[np.float64], bearings: int, lens: tuple[float, float]
) -> tuple[Ranges, Ranges]:
    """Range (N, B) [m] to the first cell that may be occupied, and to the first that is, along `bearings` rays from every place.

    Args:
        squares: of `rays.empty_squares`, with all cells occupied that are not known to be free, and of the occupied ones.
        places: (N, 2) in the grid's frame [m]; nan where there is none.
        bearings: rays over a full turn.
        lens: cell size and farthest range [m].
    """
    first, last = np.full((len(places), bearings), np.inf, np.float32), np.full((len(places), bearings), -np.inf, np.float32)
    resolution, reach = lens
    rays = np.empty((bearings, 3))
    rays[:, 2] = np.arange(bearings) * (2.0 * np.pi / bearings)
    for i in range(len(places)):
        if np.isnan(places[i, 0]):
            continue
        rays[:, 0], rays[:, 1] = places[i, 0], places[i, 1]
        open_to, blocked_at = cast(squares[0], rays, resolution, reach), cast(squares[1], rays, resolution, reach)
        for j in range(bearings):
            first[i, j], last[i, j] = min(open_to[j], reach), min(blocked_at[j], reach)
    return first, last


@njit
def pool(first: Ranges, last: Ranges) -> tuple[Ranges, Ranges]:
    """Least and largest range (R, C, B) about every `FINE`-th place and bearing of ranges (r, c, b), over `FINE` / 2 to each side."""
    rows, cols, bearings = (first.shape[0] + 1) // FINE, (first.shape[1] + 1) // FINE, first.shape[2] // FINE
    least, largest = np.full((rows, cols, bearings), np.inf, np.float32), np.full((rows, cols, bearings), -np.inf, np.float32)
    side = FINE // 2
    for row in range(rows):
        for col in range(cols):
            for r in range(max(FINE * row - side, 0), min(FINE * row + side + 1, first.shape[0])):
                for c in range(max(FINE * col - side, 0), min(FINE * col + side + 1, first.shape[1])):
                    for bearing in range(bearings):
                        for b in range(FINE * bearing - side, FINE * bearing + side + 1):
                            at = b % first.shape[2]
                            least[row, col, bearing] = min(least[row, col, bearing], first[r, c, at])
                            largest[row, col, bearing] = max(largest[row, col, bearing], last[r, c, at])
    return least, largest


@njit
def rate(views: tuple[Ranges, Ranges], sectors: tuple[NDArray[np.int64], Ranges], model: tuple[float, float, float]) -> Ranges:
    """Mean cost (K, B) of every place and heading: how far the scan's ranges are from what might be seen there, and how much that is.

    A range between the least and the largest of a view costs the logarithm of their distance: a view of which little is known fits all.

    Args:
        views: least and largest range (K, B) at each place and bearing [m].
        sectors: bearing (S,) from 0 to B - 1 and range (S,) [m] of the scan's sectors in base.
        model: distance that costs one [m], largest cost, the scan's farthest range [m].
    """
    least, largest = views
    width, most, reach = np.float32(model[0]), np.float32(model[1]), np.float32(model[2])
    bearings, ranges = sectors
    turns = least.shape[1]
    costs = np.full(least.shape, np.inf, np.float32)
    low, high, vague = np.empty(2 * turns, np.float32), np.empty(2 * turns, np.float32), np.empty(2 * turns, np.float32)
    total, share = np.empty(turns, np.float32), np.float32(1.0 / max(len(ranges), 1))
    inverse, nothing = np.float32(1.0) / width, np.float32(0.0)
    for k in range(len(least)):
        for b in range(turns):
            low[b], high[b] = min(least[k, b], reach), min(largest[k, b], reach)
            vague[b] = np.log(np.float32(1.0) + max(high[b] - low[b], nothing) * inverse)
            low[turns + b], high[turns + b], vague[turns + b] = low[b], high[b], vague[b]
        total[:] = nothing
        for i in range(len(ranges)):
            near, far, cost, z = low[bearings[i] :], high[bearings[i] :], vague[bearings[i] :], ranges[i]
            for heading in range(turns):
                off = max(near[heading] - z, z - far[heading], nothing)
                total[heading] += min(off * inverse + cost[heading], most)
        for heading in range(turns):
            costs[k, heading] = total[heading] * share
    return costs


@njit
def valleys(costs: Ranges, neighbours: NDArray[np.int64], margin: float, most: float) -> NDArray[np.int64]:
    """Flat indices of the places and headings (K, B) that cost at most so much, and that no neighbour undercuts by more than a margin.

    Args:
        costs: (K, B)
        neighbours: (K, 8) places around each, -1 where there is none.
        margin: 0 keeps the lowest alone; with more a slope that is all but level keeps some of its places.
        most: cost beyond which none is kept.
    """
    turns = costs.shape[1]
    found = np.empty(int(np.count_nonzero(costs <= most)), np.int64)
    n = 0
    for k in range(len(costs)):
        for heading in range(turns):
            if costs[k, heading] > most:
                continue
            here, lowest = costs[k, heading] - np.float32(margin), True
            for side in (heading - 1, heading + 1):
                lowest = lowest and here <= costs[k, side % turns]
            for i in range(8):
                if not lowest:
                    break
                other = neighbours[k, i]
                for side in range(heading - 1, heading + 2):
                    lowest = lowest and (other < 0 or here <= costs[other, side % turns])
            if lowest:
                found[n] = k * turns + heading
                n += 1
    return found[:n]
