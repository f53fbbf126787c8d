"""How much a window of a picture looks like a person: HOG and a linear SVM, in a picture turned level.

Dalal, Triggs, "Histograms of oriented gradients for human detection" (2005), with the weights that OpenCV brings.
"""

from __future__ import annotations

import math
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from slam.messages import CameraInfo
from slam.se2 import FloatArray
from slam.se3 import SE3

Box = tuple[float, float, float, float]
"""Left, top, width, height [px]."""

WHOLE_BODY = 4.0 / 3.0
"""Height of the detector's window over that of the body in it: 128 / 96."""
WINDOW = (64, 128)
"""Width and height of the window that the detector was trained on [px]."""
AXES = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""R_base_camera of a camera that looks straight ahead."""
LEVELS = 3
"""Sizes of the picture that are kept, each half the one before: large windows are cut from a small one."""


class LevelPicture:
    """A colour picture as a camera sees it that is not pitched or rolled."""

    def __init__(self, colour: NDArray[np.uint8], info: CameraInfo) -> None:
        """Turn a picture (H, W, 3) of red, green, blue level."""
        H = levelling(info)
        size = info.width, info.height
        bgr = np.ascontiguousarray(colour[:, :, ::-1])
        self._sizes = [cv2.warpPerspective(bgr, H, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)]
        for _ in range(LEVELS - 1):
            self._sizes.append(cv2.resize(self._sizes[-1], None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA))
        self._P = H @ np.array(info.K) @ info.T_base_camera.R.T
        self._eye = np.array(info.T_base_camera.t)

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Columns and rows (N,) [px] of points (N, 3) of base [m]; the lens's distortion is left out."""
        columns, rows, scale = self._P @ (points - self._eye).T
        return columns / scale, rows / scale

    def window(self, foot: tuple[float, float], height: float) -> Box:
        """The detector's window about a body of a height [m] that stands at a place (x, y) of base [m]."""
        columns, rows = self.project(np.array([[*foot, 0.0], [*foot, height]]))
        tall = WHOLE_BODY * float(rows[0] - rows[1])
        return float(columns[0]) - 0.25 * tall, 0.5 * float(rows[0] + rows[1]) - 0.5 * tall, 0.5 * tall, tall

    def score(self, box: Box) -> float:
        """The SVM's answer for a window, which may reach beyond the picture: above 0 it looks like a person."""
        level = min(max(math.ceil(math.log2(max(box[3], 1.0) / (2.0 * WINDOW[1]))), 0), LEVELS - 1)
        picture = self._sizes[level]
        x, y, w, h = (edge / 2.0**level for edge in box)
        M = np.array([[WINDOW[0] / w, 0.0, -x * WINDOW[0] / w], [0.0, WINDOW[1] / h, -y * WINDOW[1] / h]])
        hog, weights, offset = _detector()
        window = cv2.warpAffine(picture, M, WINDOW, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        features = hog.compute(window)
        return float(np.asarray(features, np.float32).reshape(-1) @ weights) + offset


def levelling(info: CameraInfo) -> FloatArray:
    """Homography (3, 3) to the picture of a camera that is not pitched or rolled, at the same height of the horizon in it.

    A camera that is pitched up sees people lean outwards at the sides of its picture; the detector knows only upright ones.
    """
    axis = info.T_base_camera.R[:, 2]
    level = SE3.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, math.atan2(axis[1], axis[0]))).R @ AXES
    R = level.T @ info.T_base_camera.R
    ahead = R.T[:, 2]
    K = np.array(info.K)
    K[1, 2] += info.K[1, 1] * ahead[1] / ahead[2]
    return K @ R @ np.linalg.inv(info.K)


def overlap(a: Box, b: Box) -> float:
    """Intersection over union of two boxes."""
    across = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    down = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    common = max(across, 0.0) * max(down, 0.0)
    return common / (a[2] * a[3] + b[2] * b[3] - common)


@cache
def _detector() -> tuple[cv2.HOGDescriptor, NDArray[np.float32], float]:
    """Descriptor, weights and offset of OpenCV's people detector."""
    weights = np.array(cv2.HOGDescriptor.getDefaultPeopleDetector(), np.float32).reshape(-1)
    return cv2.HOGDescriptor(), weights[:-1], float(weights[-1])
