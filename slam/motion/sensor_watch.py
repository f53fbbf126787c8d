"""Notices a sensor that the body has and that does not speak."""

from __future__ import annotations

import math
from collections.abc import Sequence

from slam.messages import Imu, LaserScan, RgbdImage, SensorFrame, WheelOdometry

PATIENCE = 0.5
"""Shortest silence that counts [s]."""
MISSED_READINGS = 5.0
"""Silence that counts, in periods of the sensor: some recordings hold a scan every few seconds only."""

_Reading = WheelOdometry | Imu | LaserScan | RgbdImage
_NAMES = {"odometry": "wheel odometry", "imu": "gyro", "scans": "lidar", "images": "camera"}


class SensorWatch:
    """Remembers when each sensor spoke; the camera counts where images are asked for."""

    def __init__(self, *, images: bool = False) -> None:
        self._images = images
        self._heard: dict[str, tuple[float, float, int]] = {}  # first and last time, readings

    def silent(self, frame: SensorFrame) -> str:
        """Names the sensors that this body has and that are silent, or say nothing finite; empty when all is well."""
        readings: dict[str, Sequence[_Reading]] = {
            "odometry": [reading for reading in frame.odometry if reading.T_odom_base.is_finite()],
            "imu": [reading for reading in frame.imu if math.isfinite(reading.yaw_rate)],
            "scans": frame.scans,
            **({"images": frame.images} if self._images else {}),
        }
        late = [_NAMES[sensor] for sensor, new in readings.items() if sensor in frame.available and self._late(sensor, new, frame.stamp)]
        return f"silent: {', '.join(late)}" if late else ""

    def _late(self, sensor: str, new: Sequence[_Reading], now: float) -> bool:
        first, last, count = self._heard.setdefault(sensor, (now, now, 0))
        if new:
            first, last, count = (first if count else new[0].stamp), new[-1].stamp, count + len(new)
            self._heard[sensor] = first, last, count
        period = (last - first) / (count - 1) if count > 1 else 0.0
        return now - last > max(PATIENCE, MISSED_READINGS * period)
