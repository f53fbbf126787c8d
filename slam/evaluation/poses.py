"""Planar poses by the thousand: arrays (N, 3) of x, y [m], yaw [rad], composed row by row."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.errors import TrajectoryError
from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray


def wrap_angles(angles: FloatArray) -> FloatArray:
    """Wrap angles to (-pi, pi] [rad]."""
    return np.pi - np.mod(np.pi - angles, 2.0 * np.pi)


def compose(T_a_b: FloatArray, T_b_c: FloatArray) -> FloatArray:
    """Poses `T_a_b @ T_b_c`, row by row (N, 3)."""
    c, s = np.cos(T_a_b[:, 2]), np.sin(T_a_b[:, 2])
    x = T_a_b[:, 0] + c * T_b_c[:, 0] - s * T_b_c[:, 1]
    y = T_a_b[:, 1] + s * T_b_c[:, 0] + c * T_b_c[:, 1]
    return np.column_stack([x, y, wrap_angles(T_a_b[:, 2] + T_b_c[:, 2])])


def relative(T_a_b: FloatArray, T_a_c: FloatArray) -> FloatArray:
    """Poses `T_b_c = inverse(T_a_b) @ T_a_c`, row by row (N, 3)."""
    c, s = np.cos(T_a_b[:, 2]), np.sin(T_a_b[:, 2])
    dx, dy = (T_a_c[:, :2] - T_a_b[:, :2]).T
    return np.column_stack([c * dx + s * dy, c * dy - s * dx, wrap_angles(T_a_c[:, 2] - T_a_b[:, 2])])


def transform(T_a_b: SE2, T_b_c: FloatArray) -> FloatArray:
    """Poses (N, 3) of one frame, expressed in another."""
    return np.column_stack([T_a_b.transform(T_b_c[:, :2]), wrap_angles(T_b_c[:, 2] + T_a_b.yaw)])


def sample(trajectory: Trajectory, stamps: FloatArray) -> FloatArray:
    """Poses (M, 3) at `stamps` (M,): along a constant twist between samples, held beyond the ends.

    Raises:
        TrajectoryError: the trajectory is empty.
    """
    before, fraction = bracket(trajectory, stamps)
    poses = trajectory.poses
    after = np.minimum(before + 1, len(trajectory) - 1)
    xi = _log(relative(poses[before], poses[after]))
    return compose(poses[before], _exp(xi * fraction[:, None]))


def bracket(trajectory: Trajectory, stamps: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Index (M,) of the sample at or before each stamp and how far (M,), in 0..1, the stamp lies towards the next sample.

    Raises:
        TrajectoryError: the trajectory is empty or its stamps run back.
    """
    times = trajectory.stamps
    if len(times) == 0:
        raise TrajectoryError("a trajectory without poses cannot be sampled")
    if np.any(np.diff(times) < 0.0):
        raise TrajectoryError(f"stamps must not run back, they do after {times[np.argmax(np.diff(times) < 0.0)]:.6f} s")
    before = np.clip(np.searchsorted(times, stamps, side="right") - 1, 0, max(len(times) - 2, 0)).astype(np.int64)
    after = np.minimum(before + 1, len(times) - 1)
    gap = times[after] - times[before]
    fraction = np.divide(stamps - times[before], gap, out=np.zeros_like(gap), where=gap > 0.0)
    return before, np.clip(fraction, 0.0, 1.0)


def nearest(times: FloatArray, stamps: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Index (M,) of the time nearest to each stamp and how far away it is (M,) [s]; infinitely far where there are no times."""
    if len(times) == 0:
        return np.zeros(len(stamps), np.int64), np.full(len(stamps), np.inf)
    after = np.clip(np.searchsorted(times, stamps), 0, len(times) - 1)
    before = np.maximum(after - 1, 0)
    index = np.where(np.abs(times[before] - stamps) <= np.abs(times[after] - stamps), before, after)
    return index, np.abs(times[index] - stamps)


def _exp(xi: FloatArray) -> FloatArray:
    a, b = _left_jacobian_terms(xi[:, 2])
    return np.column_stack([a * xi[:, 0] - b * xi[:, 1], b * xi[:, 0] + a * xi[:, 1], xi[:, 2]])


def _log(poses: FloatArray) -> FloatArray:
    a, b = _left_jacobian_terms(poses[:, 2])
    scale = 1.0 / (a * a + b * b)
    return np.column_stack([(a * poses[:, 0] + b * poses[:, 1]) * scale, (a * poses[:, 1] - b * poses[:, 0]) * scale, poses[:, 2]])


def _left_jacobian_terms(omega: FloatArray) -> tuple[FloatArray, FloatArray]:
    """sin(w)/w and (1 - cos(w))/w; numpy's sinc(x) is sin(pi x)/(pi x)."""
    return np.sinc(omega / np.pi), np.sinc(omega / (2.0 * np.pi)) * np.sin(0.5 * omega)
