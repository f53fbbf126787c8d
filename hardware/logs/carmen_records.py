"""The records of a CARMEN log, field by field, and the fan of beams they imply."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from hardware.logs.log import Reading
from slam.messages import LaserScan, Twist
from slam.se2 import FloatArray

Pose = tuple[float, float, float]

FIELDS_OF_VIEW_DEG = {180: 180.0, 181: 180.0, 360: 180.0, 361: 180.0, 401: 100.0, 541: 270.0, 1081: 270.0}
"""Number of beams -> the angle they span: SICK LMS at 1, 0.5 and 0.25 deg, Hokuyo UTM and SICK LMS1xx at 0.5 and 0.25 deg."""
DEFAULT_FIELD_OF_VIEW_DEG = 180.0
LIMIT_SHARE, LIMIT_SAMPLE = 0.01, 100
"""A largest reading with more than this share of all, of at least so many, is "nothing seen"."""


@dataclass(frozen=True, slots=True)
class Fan:
    """Directions of a laser's beams."""

    angle_min: float
    """Direction of the first beam [rad]."""
    angle_increment: float
    """[rad]"""


@dataclass(frozen=True, slots=True)
class LaserRecord:
    """A scan with the wheels' pose of its instant. Only `ROBOTLASER1` tells fan, largest range and speed."""

    time: float
    ranges: FloatArray
    pose: Pose
    twist: Twist = field(default_factory=Twist)
    fan: Fan | None = None
    range_max: float | None = None


def odometry_record(fields: list[bytes]) -> tuple[float, Pose, Twist]:
    """Time, pose and speed of an `ODOM` line; the logger's time may be missing.

    Raises:
        ValueError: it has another number of fields, or one that is no number.
    """
    if len(fields) not in (9, 10):
        raise ValueError(f"ODOM has {len(fields)} fields, 10 expected")
    x, y, theta, v, omega, _, time = (float(text) for text in fields[1:8])
    return time, (x, y, theta), Twist(v, omega)


def flaser_record(fields: list[bytes]) -> LaserRecord:
    """A `FLASER` line; the logger's time may be missing.

    Raises:
        ValueError: it has another number of fields, or one that is no number.
    """
    beams = int(fields[1]) if len(fields) > 1 else 0
    _check_length("FLASER", beams, len(fields), beams + 11)
    x, y, theta, time = (float(text) for text in fields[beams + 5 : beams + 9])
    return LaserRecord(time, _ranges(fields[2 : beams + 2]), (x, y, theta))


def robotlaser_record(fields: list[bytes]) -> LaserRecord:
    """A `ROBOTLASER1` line; the logger's time may be missing.

    Raises:
        ValueError: it has another number of fields, one that is no number, or beams without directions.
    """
    beams = int(fields[8]) if len(fields) > 8 else 0
    remissions = int(fields[beams + 9]) if 2 <= beams < len(fields) - 9 else 0
    _check_length("ROBOTLASER1", beams, len(fields), beams + max(remissions, 0) + 24)
    start, span, increment, range_max = (float(text) for text in fields[2:6])
    fan = Fan(start, increment if increment > 0.0 else span / (beams - 1))
    if not (abs(fan.angle_min) <= math.tau and 0.0 < fan.angle_increment * (beams - 1) <= 1.01 * math.tau):
        raise ValueError(f"ROBOTLASER1 has {beams} beams from {start} rad in steps of {increment} rad, which is no fan")
    tail = fields[beams + max(remissions, 0) + 13 :]
    x, y, theta, v, omega, _, _, _, time = (float(text) for text in tail[:9])
    return LaserRecord(time, _ranges(fields[9 : beams + 9]), (x, y, theta), Twist(v, omega), fan, range_max if range_max > 0.0 else None)


SCAN_RECORDS = {b"FLASER": flaser_record, b"ROBOTLASER1": robotlaser_record}


def _check_length(name: str, beams: int, length: int, expected: int) -> None:
    if beams < 2 or length not in (expected - 1, expected):
        raise ValueError(f"{name} of {beams} beams has {length} fields, {expected} expected")


def _ranges(fields: list[bytes]) -> FloatArray:
    return np.array([float(text) for text in fields])


def field_of_view_deg(beams: int, parameters: Mapping[bytes, float]) -> tuple[float, bool]:
    """Angle that `beams` span, and whether the parameters' resolution agrees with it."""
    resolution = parameters.get(b"laser_front_laser_resolution", 0.0)
    told = parameters.get(b"laser_front_laser_fov", 0.0)
    known = told if 0.0 < told <= 360.0 else FIELDS_OF_VIEW_DEG.get(beams)
    if known is None and 0.0 < resolution * (beams - 1) <= 360.0:
        return resolution * (beams - beams % 2), True
    view = DEFAULT_FIELD_OF_VIEW_DEG if known is None else known
    return view, resolution == 0.0 or abs(resolution * beams - view) < 1.5 * resolution


def centred_fan(beams: int, view_deg: float) -> Fan:
    """A fan from minus half its view on; an even number of beams leaves out the last."""
    return Fan(-math.radians(view_deg / 2), math.radians(view_deg / (beams - beams % 2)))


def repeated_limit(ranges: FloatArray) -> float | None:
    """A largest reading that repeats so often that it must mean "nothing seen"; None where something else already does."""
    finite = ranges[np.isfinite(ranges)]
    if len(ranges) < LIMIT_SAMPLE or np.isinf(ranges).any() or len(finite) == 0 or finite.min() == finite.max():
        return None
    limit = float(finite.max())
    return limit if np.count_nonzero(finite == limit) > LIMIT_SHARE * len(ranges) else None


def limited(message: Reading, limit: float) -> Reading:
    """A scan whose readings from `limit` on are "nothing seen"; other readings as they are."""
    if not isinstance(message, LaserScan):
        return message
    ranges = np.where(message.ranges >= limit, np.inf, message.ranges)
    return replace(message, ranges=ranges, range_max=float(np.nextafter(limit, 0.0)))
