"""Poses x, y [m], yaw [rad], carried from the map to the frame of a grid or a table of it, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]


@njit
def into_frame(pose: Floats, frame: Floats) -> Floats:
    """A pose (3,) of the map in a frame of which the pose in the map is `frame` (3,); its heading is not wrapped."""
    c, s = np.cos(frame[2]), np.sin(frame[2])
    dx, dy = pose[0] - frame[0], pose[1] - frame[1]
    return np.array([c * dx + s * dy, c * dy - s * dx, pose[2] - frame[2]])


@njit
def out_of_frame(pose: Floats, frame: Floats) -> Floats:
    """The way back of `into_frame`."""
    c, s = np.cos(frame[2]), np.sin(frame[2])
    return np.array([frame[0] + c * pose[0] - s * pose[1], frame[1] + s * pose[0] + c * pose[1], frame[2] + pose[2]])
