"""Wheel radii, track and the lidar's mount, from wheel angles and where the lidar was.

The sensor's own path says what the wheels should have said, as in Censi, Franchi, Marchionni, Oriolo, "Simultaneous calibration
of odometry and sensor parameters for mobile robots" (2013), here over windows of a path that has been mapped, all unknowns at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from slam.errors import SlamError
from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray

PATH, TURN = 1.5, math.pi
"""A window ends when the robot has gone so far [m] or turned so much [rad]."""
STRIDE = 3
"""Scans from the begin of one window to that of the next."""
POSITION, HEADING = 0.005, math.radians(0.2)
"""What the lidar's relative poses are good to [m, rad]; a window that is off by much more counts for less."""
LEAST_WINDOWS = 10
ASTRAY = 20.0
"""More than so many times these is no measurement of wheels."""
FAR_OFF = 1.5
"""Nobody is wrong about wheels and track by more than this factor."""
VAGUE = 0.02
"""A number whose standard deviation is a larger share of it is not known [1]."""


@dataclass(frozen=True, slots=True)
class WheelCalibration:
    """What fits the drive."""

    wheel_radii: tuple[float, float]
    """Left, right [m]."""
    track: float
    """[m]"""
    T_base_laser: SE2
    deviations: FloatArray
    """(6,) standard deviations of radii, track [m], x, y [m] and yaw [rad] of the lidar."""
    windows: int


class CalibrationError(SlamError):
    """A drive that does not say enough."""


def calibrate_wheels(
    stamps: FloatArray, angles: FloatArray, sensor: Trajectory, first: tuple[tuple[float, float], float, SE2]
) -> WheelCalibration:
    """Least squares, with a soft L1 loss against wheels that slipped.

    Args:
        stamps: (N,) of the encoder readings [s].
        angles: (N, 2) of left and right wheel, cumulative [rad].
        sensor: poses of the lidar in the map, at its scans.
        first: radii, track and `T_base_laser` to begin from.

    Raises:
        CalibrationError: the drive is too short, or too straight, or never straight.
    """
    inside = (sensor.stamps >= stamps[0]) & (sensor.stamps <= stamps[-1]) if len(stamps) else np.zeros(len(sensor), np.bool_)
    times, poses = sensor.stamps[inside], np.array(sensor.poses[inside])
    poses[:, 2] = np.unwrap(poses[:, 2])
    (left, right), track, T_base_laser = first
    start = np.array([left, right, track, *T_base_laser.as_array()])
    turned = _at(times, stamps, angles) if len(times) > 1 else np.zeros((2, 2))
    pairs, apart = _windows(turned, start)
    if apart < LEAST_WINDOWS:
        raise CalibrationError(f"the drive has {apart:.0f} stretches of {PATH:g} m or half a turn; {LEAST_WINDOWS} are needed: drive on")
    measured = _between(poses, pairs)
    scale = np.array([POSITION, POSITION, HEADING])

    def residuals(unknown: FloatArray) -> FloatArray:
        wheels = _path(unknown, angles)
        laser = _mounted(_at(times, stamps, wheels), unknown[3:])
        return ((_between(laser, pairs) - measured) / scale).reshape(-1)

    fit = least_squares(residuals, start, loss="soft_l1", x_scale=np.array([0.001, 0.001, 0.005, 0.01, 0.01, 0.01]))
    found = np.asarray(fit.x, dtype=np.float64)
    left_over = residuals(found)
    _require_agreement(left_over, found[:2] / start[:2])
    deviations = _deviations(np.asarray(fit.jac, dtype=np.float64), left_over, apart)
    if np.any(deviations[:3] > VAGUE * np.abs(found[:3])):
        raise CalibrationError("the drive does not tell radii and track apart: drive straight ahead and turn, to both sides")
    _require_agreement(left_over, found[2:3] / start[2:3])  # only now: a track that no turn shows is anything
    return WheelCalibration((float(found[0]), float(found[1])), float(found[2]), SE2.from_array(found[3:]), deviations, len(pairs))


def _at(times: FloatArray, stamps: FloatArray, values: FloatArray) -> FloatArray:
    """Columns of values (N, k) at stamps, interpolated at times."""
    return np.stack([np.interp(times, stamps, values[:, k]) for k in range(values.shape[1])], axis=1)


def _path(unknown: FloatArray, angles: FloatArray) -> FloatArray:
    """(N, 3) poses of the base by the wheels alone, exact along each arc; the heading is not wrapped."""
    left, right = np.diff(angles, axis=0).T * unknown[:2, None]
    way, turn = 0.5 * (left + right), (right - left) / unknown[2]
    heading = np.concatenate([[0.0], np.cumsum(turn)])
    chord = way * np.sinc(0.5 * turn / np.pi)
    middle = heading[:-1] + 0.5 * turn
    x, y = (np.concatenate([[0.0], np.cumsum(chord * part)]) for part in (np.cos(middle), np.sin(middle)))
    return np.column_stack([x, y, heading])


def _mounted(poses: FloatArray, mount: FloatArray) -> FloatArray:
    """(N, 3) poses of what is mounted on a body, from poses of the body."""
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x = poses[:, 0] + cos * mount[0] - sin * mount[1]
    y = poses[:, 1] + sin * mount[0] + cos * mount[1]
    return np.column_stack([x, y, poses[:, 2] + mount[2]])


def _between(poses: FloatArray, pairs: NDArray[np.int64]) -> FloatArray:
    """(K, 3) second pose of each pair in the frame of the first, the turn not wrapped."""
    first, second = poses[pairs[:, 0]], poses[pairs[:, 1]]
    moved = second - first
    cos, sin = np.cos(first[:, 2]), np.sin(first[:, 2])
    x, y = cos * moved[:, 0] + sin * moved[:, 1], cos * moved[:, 1] - sin * moved[:, 0]
    return np.column_stack([x, y, moved[:, 2]])


def _windows(turned: FloatArray, start: FloatArray) -> tuple[NDArray[np.int64], float]:
    """(K, 2) first and last scan of each window, and how many of them fit one after the other."""
    ways = turned * start[:2]
    rolled: FloatArray = ways[1:] - ways[:-1]
    turns = np.abs(rolled[:, 1] - rolled[:, 0]) / start[2]
    gone = np.zeros(len(turned))
    gone[1:] = np.cumsum(0.5 * (np.abs(rolled[:, 0]) + np.abs(rolled[:, 1])) / PATH + turns / TURN)
    ends = np.searchsorted(gone, gone + 1.0)
    begins = np.flatnonzero(ends < len(gone))[::STRIDE]
    return np.column_stack([begins, ends[begins]]).astype(np.int64), float(gone[-1])


def _require_agreement(left_over: FloatArray, ratios: FloatArray) -> None:
    """That little is left over, and that what is found is near what was believed in: their ratios (K,)."""
    worst = np.maximum.reduce(np.abs(left_over.reshape(-1, 3)), axis=1)
    share = np.count_nonzero(worst > ASTRAY) / max(len(worst), 1)
    if share > 0.2 or np.any(ratios > FAR_OFF) or np.any(ratios < 1.0 / FAR_OFF):
        why = "the robot was held, slipped or was carried, or the lidar has lost its way"
        raise CalibrationError(f"wheels and lidar do not agree (apart in {share:.0%} of the drive): {why}; drive where it can roll")


def _deviations(J: FloatArray, residuals: FloatArray, apart: float) -> FloatArray:
    """Standard deviations of the unknowns, when of the windows, which overlap, so many stand `apart`."""
    windows = len(residuals) / 3
    spread = float(residuals @ residuals) / max(len(residuals) - J.shape[1], 1)
    information: FloatArray = J.T @ J
    ridge = 1e-12 * float(np.trace(information)) * np.eye(len(information))  # what is not seen is not known
    covariance = np.asarray(np.linalg.inv(information + ridge), dtype=np.float64)
    return np.sqrt(np.diagonal(covariance) * spread * max(windows / apart, 1.0))
