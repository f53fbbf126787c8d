"""Connected dark regions: Rosenfeld, Pfaltz, "Sequential operations in digital picture processing" (1966), on runs of pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.darker import WORD
from slam.kernels.jit import inlined, njit

Dark = NDArray[np.uint8]
Ints = NDArray[np.int32]
TOP, LEFT, BOTTOM, RIGHT, FIRST = range(5)
"""What is kept of a region: the rows and columns that it fills, and the column of the first pixel of its top row."""


@njit
def first_pixels(dark: Dark, least: float) -> Ints:
    """Row and column (N, 2) of the first pixel of every region of at least so many pixels' width or height.

    Args:
        dark: 1 where the picture is dark, in a frame of zeros, a multiple of `WORD` wide; neighbours touch at corners too.
        least: [px].
    """
    rows, columns = dark.shape
    words, most = dark.view(np.uint64), rows * columns // 2
    starts, ends, labels = np.empty(most, np.int32), np.empty(most, np.int32), np.empty(most, np.int32)  # of the runs
    parents, boxes = np.empty(most, np.int32), np.empty((most, 5), np.int32)  # of the regions
    runs, regions, above, above_end = 0, 0, 0, 0
    for y in range(1, rows - 1):
        begin, x = runs, 0
        while x < columns:
            if x % WORD == 0 and words[y, x // WORD] == 0:
                x += WORD
            elif dark[y, x] == 0:
                x += 1
            else:
                start = x
                while dark[y, x] != 0:
                    x += 1
                while above < above_end and ends[above] < start:
                    above += 1
                region, k = -1, above
                while k < above_end and starts[k] <= x:
                    other = _root(parents, labels[k])
                    region = other if region < 0 else _joined(parents, boxes, region, other)
                    k += 1
                if region < 0:
                    region, regions = regions, regions + 1
                    parents[region], boxes[region] = region, (y, start, y, x - 1, start)
                box = boxes[region]
                box[LEFT], box[RIGHT], box[BOTTOM] = min(box[LEFT], start), max(box[RIGHT], x - 1), y
                starts[runs], ends[runs], labels[runs] = start, x, region
                runs += 1
        above, above_end = begin, runs
    found, count = np.empty((regions, 2), np.int32), 0
    for k in range(regions):
        size = max(boxes[k, RIGHT] - boxes[k, LEFT], boxes[k, BOTTOM] - boxes[k, TOP]) + 1
        if parents[k] == k and size >= least:
            found[count] = boxes[k, TOP], boxes[k, FIRST]
            count += 1
    return found[:count]


@inlined
def _root(parents: Ints, k: int) -> int:
    while parents[k] != k:
        parents[k] = parents[parents[k]]
        k = parents[k]
    return k


@inlined
def _joined(parents: Ints, boxes: Ints, a: int, b: int) -> int:
    """The older of two regions, which begins farther up, with the other in it."""
    old, new = min(a, b), max(a, b)
    parents[new] = old
    boxes[old, LEFT], boxes[old, RIGHT] = min(boxes[old, LEFT], boxes[new, LEFT]), max(boxes[old, RIGHT], boxes[new, RIGHT])
    boxes[old, BOTTOM] = max(boxes[old, BOTTOM], boxes[new, BOTTOM])
    return old
