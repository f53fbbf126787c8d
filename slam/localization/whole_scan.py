"""All that one scan says, ordered by bearing: what was hit, and where nothing was."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from slam.kernels.evidence import Beams
from slam.localization.panoramas import REACH
from slam.messages import LaserScan, Trajectory
from slam.scans import deskew
from slam.se2 import SE2, FloatArray

FEWEST = 12
"""Points below which a scan is not worth looking for."""
FULL = 0.4
"""Share of the usual number of beams that a sector must have."""


@dataclass(frozen=True, slots=True, eq=False)
class WholeScan:
    """A scan as it is looked for in a map."""

    points: FloatArray
    """(M, 2) hits in base [m]."""
    bearings: FloatArray
    """(N,) of all beams, seen from the laser, ascending from -pi [rad]."""
    ranges: FloatArray
    """(N,) [m]; of a beam that met nothing the sensor's range."""
    beams: Beams
    """Of `evidence.explain`; a part of them."""
    spacing: float
    """Between two of these [rad]."""
    reach: float
    """The sensor's range as far as it is known [m]."""
    T_base_laser: SE2
    """Mean place of the laser during the sweep, looking along base."""

    def sectors(self, bearings: int) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """Bearing (S,), 0 to `bearings` - 1, and median range (S,) [m] of the sectors of a full turn that the scan fills."""
        numbers = np.rint(self.bearings * (bearings / math.tau)).astype(np.int64) % bearings
        counts = np.bincount(numbers, minlength=bearings)
        full = np.flatnonzero(counts >= max(1.0, FULL * float(np.median(counts[counts > 0]))))
        ranges = [np.median(self.ranges[numbers == sector]) for sector in full]
        return full, np.array(ranges, np.float32)


def whole_scan(points: FloatArray, origins: FloatArray | None, clear: FloatArray | None, beams: int) -> WholeScan | None:
    """A scan of hits (M, 2), seen from origins (M, 2), and ends (C, 2) of beams that met nothing, all in base [m].

    Args:
        points: those that are not finite are left out.
        origins: base, when not given.
        clear: none, when not given.
        beams: most beams that are cast.

    Returns:
        The scan; None where it has too few points.
    """
    origins = np.zeros_like(points) if origins is None else origins
    finite = np.isfinite(points).all(axis=1) & np.isfinite(origins).all(axis=1)
    points, origins = points[finite], origins[finite]
    clear = np.empty((0, 2)) if clear is None else clear[np.isfinite(clear).all(axis=1)]
    if len(points) < FEWEST:
        return None
    laser = origins.mean(axis=0)
    ends = np.concatenate([points, clear])
    starts = np.concatenate([origins, np.broadcast_to(laser, clear.shape)])
    away = ends - laser
    bearings, ranges = np.arctan2(away[:, 1], away[:, 0]), np.hypot(away[:, 0], away[:, 1])
    reach = float(np.median(ranges[len(points) :])) if len(clear) else REACH
    order = np.argsort(bearings, kind="stable")
    stride = max(1, math.ceil(len(order) / beams))
    cast = order[stride // 2 :: stride]
    spacing = stride * float(np.median(np.diff(bearings[order])))
    hits = np.arange(len(ends)) < len(points)
    chosen = (np.ascontiguousarray(starts[cast]), np.ascontiguousarray(ends[cast]), hits[cast], max(reach, float(ranges.max())) + 1e-6)
    return WholeScan(points, bearings[order], ranges[order], chosen, max(spacing, 1e-4), reach, SE2(*laser.tolist()))


def clear_ends(scan: LaserScan, odometry: Trajectory) -> FloatArray:
    """Ends (C, 2), at the sensor's range, of the beams that met nothing, in base at the first beam's time [m], as `deskew` gives hits."""
    empty = np.where(np.isposinf(scan.ranges), scan.range_max, np.nan)
    return deskew(replace(scan, ranges=empty), odometry).points
