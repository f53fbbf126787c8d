"""How well a scan's geometry can place it: along a corridor not at all, in a round room not in heading."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.kernels import localizability as kernels
from slam.kernels.uncertainty import turned
from slam.se2 import SE2, FloatArray


def scan_information(points: FloatArray, T_target_source: SE2) -> FloatArray:
    """Fisher information (3, 3) of (x, y, yaw) in the target frame of a scan's points (M, 2) [m], in any order."""
    return turned(kernels.information(points, kernels.RANGE_NOISE), T_target_source.yaw)


@dataclass(frozen=True, slots=True)
class Localizability:
    """Cramér-Rao bounds: no matcher that looks at this scan alone can do better."""

    weakest: float = math.inf
    """Standard deviation along the axis that is known worst [m]; infinite where the scan says nothing."""
    strongest: float = math.inf
    """Along the axis across it [m]."""
    heading: float = math.inf
    """[rad]"""
    axis: float = 0.0
    """Direction of the weakest axis in the target's frame, in (-pi/2, pi/2] [rad]."""

    @classmethod
    def of(cls, points: FloatArray, T_target_source: SE2) -> Localizability:
        """Of a scan's points (M, 2) [m] seen from the origin of their frame, in any order."""
        return cls.from_information(scan_information(points, T_target_source))

    @classmethod
    def from_information(cls, information: FloatArray) -> Localizability:
        """Of the Fisher information (3, 3) of (x, y, yaw) in the target's frame."""
        I_tt, I_th, I_hh = information[:2, :2], information[:2, 2], float(information[2, 2])
        place = I_tt - np.outer(I_th, I_th) / I_hh if I_hh > 0.0 else I_tt
        values, vectors = np.linalg.eigh(place)
        known, axes = np.linalg.eigh(I_tt)
        shared = sum(float(axes[:, k] @ I_th) ** 2 / known[k] for k in (0, 1) if known[k] > 1e-9 * max(known[1], 1e-9))
        direction = math.atan2(vectors[1, 0], vectors[0, 0])
        axis = 0.5 * math.remainder(2.0 * direction, math.tau)
        return cls(_deviation(values[0]), _deviation(values[1]), _deviation(I_hh - shared), axis if axis > -0.5 * math.pi else -axis)


def _deviation(information: float) -> float:
    return 1.0 / math.sqrt(information) if information > 0.0 else math.inf
