"""Frames of a foreign recording: where its laser sits, and where its odometry says that the robot is."""

from __future__ import annotations

from typing import Any

import numpy as np

from slam.se2 import SE2
from slam.se3 import SE3

BASES = ("base_footprint", "base_link", "base")
"""Names that robots give to `base`, the one on the floor first."""
ODOMETRY = "odom"


class FrameTree:
    """The newest transform of every child frame; what moves is told apart by `odom` being its parent."""

    def __init__(self) -> None:
        self._parents: dict[str, tuple[str, SE3]] = {}

    def add(self, transforms: list[Any]) -> None:
        """Take in the transforms of a tf2_msgs/TFMessage."""
        for stamped in transforms:
            child = name_of(stamped.child_frame_id)
            self._parents[child] = name_of(stamped.header.frame_id), pose3_of(stamped.transform.translation, stamped.transform.rotation)

    def base(self, stated: str = "") -> str:
        """The robot's frame: the one that its odometry names, else one of the usual names that occurs."""
        known = {*self._parents, *(parent for parent, _ in self._parents.values())}
        return name_of(stated) or next((name for name in BASES if name in known), BASES[1])

    def between(self, target: str, source: str) -> SE3 | None:
        """`T_target_source` by way of a common parent; None where the frames are not connected."""
        up_target, up_source = self._upwards(target), self._upwards(source)
        common = next((frame for frame in up_source if frame in up_target), None)
        return None if common is None else up_target[common].inverse() @ up_source[common]

    def _upwards(self, frame: str) -> dict[str, SE3]:
        """`T_ancestor_frame` for the frame itself and every ancestor, nearest first."""
        found = {frame: SE3()}
        while frame in self._parents and self._parents[frame][0] not in found:
            parent, T_parent_frame = self._parents[frame]
            found[parent] = T_parent_frame @ found[frame]
            frame = parent
        return found


def name_of(frame: str) -> str:
    """A frame's name as ROS 2 writes it, without the leading slash of ROS 1."""
    return frame.strip().lstrip("/")


def pose3_of(position: Any, q: Any) -> SE3:
    """A transform from a message's vector and quaternion.

    Raises:
        ValueError: it is not finite, or the quaternion is zero.
    """
    t, xyzw = np.array([position.x, position.y, position.z]), np.array([q.x, q.y, q.z, q.w])
    if not (np.isfinite(t).all() and np.isfinite(xyzw).all() and np.linalg.norm(xyzw) > 0.5):
        raise ValueError(f"the transform {t.tolist()}, {xyzw.tolist()} is none")
    return SE3.from_quaternion(xyzw, t)


def pose2_of(position: Any, q: Any) -> SE2:
    """The same, projected on the floor.

    Raises:
        ValueError: it is not finite, or the quaternion is zero.
    """
    return pose3_of(position, q).to_se2()
