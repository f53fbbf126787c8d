"""What ROS messages would round, brought through with the same bits.

A ROS time counts whole nanoseconds, a heading travels as a quaternion, a LaserScan carries float32: stamps that are whole
nanoseconds, all headings, and ranges and depths that are whole millimetres come back as they were.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np
from numpy.typing import NDArray

from slam.se2 import FloatArray

NANOSECONDS = 1_000_000_000
_NUDGES = sorted(product(range(-3, 4), repeat=2), key=lambda nudge: abs(nudge[0]) + abs(nudge[1]))


def nanoseconds(stamp: float) -> int:
    """A stamp [s] in whole nanoseconds."""
    return round(stamp * NANOSECONDS)


def time_of(stamp: float) -> tuple[int, int]:
    """A stamp [s] as seconds and nanoseconds."""
    return divmod(nanoseconds(stamp), NANOSECONDS)


def stamp_of(seconds: int, nanosecond: int) -> float:
    """The stamp [s] of a time."""
    return (seconds * NANOSECONDS + nanosecond) / NANOSECONDS


def half_turn(yaw: float) -> tuple[float, float]:
    """(z, w) of the quaternion of a heading [rad], of those within a few units in the last place the one that gives it back exactly."""
    z, w = math.sin(yaw / 2), math.cos(yaw / 2)
    step_z, step_w = math.ulp(z), max(math.ulp(w), math.ulp(yaw) / 2)
    for i, j in _NUDGES:
        if heading(z + i * step_z, w + j * step_w) == yaw:
            return z + i * step_z, w + j * step_w
    return z, w


def heading(z: float, w: float) -> float:
    """Heading [rad] of a quaternion about the z axis."""
    return 2.0 * math.atan2(z, w)


def widened(ranges: NDArray[np.float32]) -> FloatArray:
    """Ranges [m] as they were before float32: whole millimetres where that is what was rounded, else the float32 itself."""
    millimetres = np.rint(ranges.astype(np.float64) * 1000.0) / 1000.0
    return np.where(millimetres.astype(np.float32) == ranges, millimetres, ranges.astype(np.float64))


def whole_millimetres(depth: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Depths [m] in whole millimetres, those that are not measured as 0; what is farther than 65.535 m is given as not measured."""
    depth_mm = np.rint(depth * np.float32(1000.0))
    return np.where(depth_mm <= np.float32(65535.0), depth_mm, np.float32(0.0)).astype(np.uint16)


def metres(depth_mm: NDArray[np.uint16]) -> NDArray[np.float32]:
    """The depths [m] of `whole_millimetres`, nan where not measured."""
    depth = depth_mm.astype(np.float32) / np.float32(1000.0)
    return np.where(depth_mm == 0, np.float32(np.nan), depth)
