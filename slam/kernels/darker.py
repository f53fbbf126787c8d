"""Where a picture is darker than about the same place: Bradley, Roth, "Adaptive thresholding using the integral image" (2007).

As the limit is a share of the light about, neither shade matters nor how bright the lamps are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Grey = NDArray[np.uint8]
SIDE = 13
"""Of the neighbourhood [px]: 8 + 4 + 1, by which rows are summed."""
WORD = 8
"""The result is a multiple of so many pixels wide, to be read by 64 bits."""


@njit
def darker_than_around(grey: Grey, share: float, least: float) -> Grey:
    """1 where a picture (H, W) is dark, in a frame of zeros: (H + 2, at least W + 2), the picture's first pixel at [1, 1].

    Args:
        grey: the picture.
        share: dark is what is darker than the neighbourhood's mean by more than this share of it,
        least: and by more than this, the camera's noise [grey levels].
    """
    height, width = grey.shape
    half, wide = SIDE // 2, width + SIDE - 1
    dark = np.zeros((height + 2, (width + 2 + WORD - 1) // WORD * WORD), np.uint8)
    one, two, four, eight = np.zeros((4, wide + WORD), np.float32)  # sums over so many columns from here on: whole numbers
    area = np.float32(SIDE * SIDE)
    keep, noise = np.float32(1.0 - share), np.float32(least) * area
    for y in range(-half, half + 1):
        row = grey[min(max(y, 0), height - 1)]
        for x in range(width):
            one[half + x] += np.float32(row[x])
    for y in range(height):
        if y > 0:
            entering, leaving = grey[min(y + half, height - 1)], grey[max(y - half - 1, 0)]
            for x in range(width):
                one[half + x] += np.float32(entering[x]) - np.float32(leaving[x])
        one[:half], one[half + width : wide] = one[half], one[half + width - 1]
        for x in range(wide):
            two[x] = one[x] + one[x + 1]
        for x in range(wide):
            four[x] = two[x] + two[x + 2]
        for x in range(wide):
            eight[x] = four[x] + four[x + 4]
        row, out = grey[y], dark[y + 1]
        for x in range(width):
            around, here = eight[x] + four[x + 8] + one[x + 12], area * np.float32(row[x])
            out[x + 1] = np.uint8((here < keep * around) & (here + noise < around))
    return dark
