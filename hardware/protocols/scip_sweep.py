"""Scans of SCIP 2.0: data lines to ranges and back (specification C-42-03320B)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hardware.protocols.errors import ProtocolError
from hardware.protocols.scip import Reply
from hardware.protocols.scip_numbers import decode_number, decode_numbers, encode_number, encode_numbers
from slam.se2 import FloatArray

WRAP_MS = 1 << 24
"""Time stamps count up to this [ms]: 4 h 39 min 37 s."""
BLOCK = 64
"""Characters of data in one line, before its sum."""
SHORTEST_MM = 20
"""Ranges below are codes: 0 nothing within reach, the others a reason why there is no range."""


class Sweep(NamedTuple):
    """One scan as the lidar delivers it."""

    stamp_ms: int
    """The lidar's clock when it passed its zero, 24 bits."""
    ranges_mm: NDArray[np.int64]
    """(N,); below `SHORTEST_MM` a code."""


def sweep_lines(sweep: Sweep, size: int) -> tuple[str, ...]:
    """Stamp and ranges as data lines; `size` is the number of characters of a range."""
    text = encode_numbers(sweep.ranges_mm, size)
    return (encode_number(sweep.stamp_ms % WRAP_MS, 4), *(text[k : k + BLOCK] for k in range(0, len(text), BLOCK)))


def parse_sweep(reply: Reply, size: int, beams: int) -> Sweep:
    """The scan of GD, GS, MD or MS.

    Raises:
        ProtocolError: it is cut, or has not that many beams.
    """
    if not reply.lines or len(reply.lines[0]) != 4:
        raise ProtocolError("SCIP", "a scan without its time stamp", reply.echo.encode("latin-1", "replace"))
    ranges = decode_numbers("".join(reply.lines[1:]), size)
    if len(ranges) != beams:
        raise ProtocolError("SCIP", f"a scan of {len(ranges)} beams where {beams} were asked for")
    return Sweep(decode_number(reply.lines[0]), ranges)


def to_metres(ranges_mm: NDArray[np.int64], longest_mm: int) -> FloatArray:
    """Ranges (N,) after REP 117 [m]: code 0 is +inf, every other code nan; beyond the lidar's reach +inf."""
    ranges = np.asarray(ranges_mm, np.float64) / 1000.0  # not times 1e-3: 5600 mm is not beyond 5.6 m
    ranges[ranges_mm < SHORTEST_MM] = np.nan
    ranges[(ranges_mm == 0) | (ranges_mm > longest_mm)] = np.inf
    return ranges


def to_millimetres(ranges: FloatArray) -> NDArray[np.int64]:
    """What a lidar says for ranges (N,) after REP 117 [m]: +inf is code 0, nan and what is too near code 7."""
    codes = np.where(ranges == np.inf, 0, 7)
    finite = np.isfinite(ranges)
    values_mm = np.rint(np.where(finite, ranges, 0.0) * 1e3).astype(np.int64)
    return np.where(finite & (values_mm >= SHORTEST_MM), values_mm, codes).astype(np.int64)
