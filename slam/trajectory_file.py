"""Trajectories as TUM text files: one `stamp x y z qx qy qz qw` a line, as the TUM RGB-D benchmark and evo have them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slam.atomic_file import replacing
from slam.errors import TrajectoryError
from slam.messages import Trajectory
from slam.table_file import read_table

COLUMNS = "stamp x y z qx qy qz qw"
FORMAT = ["%.9f"] * 4 + ["%.12f"] * 4


def read_trajectory(path: Path) -> Trajectory:
    """Read a TUM file, projected on the floor: x, y and the yaw of the quaternion.

    Raises:
        TrajectoryError: the file cannot be read, a line does not hold eight finite numbers, or stamps run back.
    """
    rows = read_table(path, COLUMNS)
    back = np.flatnonzero(np.diff(rows[:, 0]) < 0.0)
    if len(back):
        raise TrajectoryError(f"{path}: stamps must not run back, they do after {rows[back[0], 0]:.6f} s")
    qx, qy, qz, qw = rows[:, 4:].T
    yaw = np.arctan2(2.0 * (qw * qz + qx * qy), qw**2 + qx**2 - qy**2 - qz**2)
    return Trajectory(rows[:, 0], np.column_stack([rows[:, 1:3], yaw]))


def write_trajectory(path: Path, trajectory: Trajectory) -> None:
    """Write a TUM file with z = 0, whole or not at all.

    Raises:
        TrajectoryError: the file cannot be written.
    """
    x, y, yaw = trajectory.poses.T
    zero = np.zeros_like(yaw)
    rows = np.column_stack([trajectory.stamps, x, y, zero, zero, zero, np.sin(0.5 * yaw), np.cos(0.5 * yaw)])
    try:
        with replacing(Path(path)) as partial:
            np.savetxt(partial, rows, fmt=FORMAT)
    except OSError as error:
        raise TrajectoryError(f"{path}: cannot be written: {error.strerror}") from error
