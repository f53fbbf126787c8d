"""How much more the robot turns and drives than wheels and gyro say, from steps that markers have put right.

A gyro's scale is wrong by a per cent or two, always the same way: learnt where markers are in view, it carries the robot where none is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slam.se2 import SE2, FloatArray

TURN_DEVIATION = 0.03
"""Of the turns' scale before anything is known."""
STEP_DEVIATION = 0.001
"""Error of a step's turn that is no scale [rad]."""
DISTANCE = 2.0
"""Way from which the distances' ratio means something [m]."""


@dataclass(frozen=True, slots=True)
class OdometryScales:
    """Factors."""

    turn: float = 1.0
    """Of every turn."""
    distance: float = 1.0
    """Of every distance; nothing is corrected by it: it says whether the markers are as large as they are said to be."""

    @classmethod
    def fitted(cls, poses: FloatArray, steps: FloatArray) -> OdometryScales:
        """From poses (N, 3) and the steps (N - 1, 3) that odometry saw between them: x, y [m], yaw [rad]."""
        turns = np.diff(poses[:, 2])
        off = np.remainder(turns - steps[:, 2] + np.pi, 2.0 * np.pi) - np.pi
        variance = STEP_DEVIATION**2
        turn = 1.0 + float(steps[:, 2] @ off / variance / (steps[:, 2] @ steps[:, 2] / variance + TURN_DEVIATION**-2))
        way = float(np.hypot(steps[:, 0], steps[:, 1]).sum())
        found = float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum())
        return cls(turn, found / way if way > DISTANCE else 1.0)

    def corrected(self, step: SE2) -> SE2:
        """A step that turns as much more as it should."""
        x, y, turn = step.log()
        return SE2.exp(np.array([x, y, turn * self.turn]))
