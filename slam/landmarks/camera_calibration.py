"""K and distortion of a camera from views of a board: Zhang, "A flexible new technique for camera calibration" (2000), by OpenCV."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, cast

import cv2
import numpy as np

from slam.errors import SlamError
from slam.landmarks.boards import Board, BoardView
from slam.messages import CameraInfo
from slam.se2 import FloatArray

Distortion = Literal["none", "radial", "full"]
FEWEST_VIEWS = 3
MOST_VIEWS = 60
DIFFERENT, NOT_THE_SAME = 0.06, 0.005
"""Least change of a board's place in the picture between two views of a film that both count, and between two photographs, as a share
of the picture's width."""
STILL = 0.3
"""Most that a board may have moved since the film's picture before [px]: otherwise a rolling shutter bends it."""
OUTLIER, TOLERATED = 3.0, 0.5
"""A view is left out whose RMS is so many times the median view's, and above that [px]."""
UNKNOWN = 0.1
"""Relative deviation of the focal length from which on it is not known."""
LEAST_TILT = math.radians(2.5)
"""Between boards: those that are parallel say nothing of the focal length."""
_HELD: dict[Distortion, int] = {
    "none": cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    "radial": cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    "full": 0,
}


class CalibrationError(SlamError):
    """Views from which no camera can be calibrated."""


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A calibrated camera."""

    camera: CameraInfo
    """K, D and size; its mount and its shutter are not known from still pictures."""
    rms: float
    """Of the reprojection errors' lengths over all corners of the views used [px]."""
    deviations: FloatArray
    """(4,) standard deviations of fx, fy, cx, cy [px]."""
    used: tuple[int, ...]
    """Numbers of the views used."""
    residuals: tuple[FloatArray, ...]
    """(K, 2) seen less projected [px], of each view used."""
    tilt: float
    """Largest angle between two views' boards [rad]."""


class ViewChoice:
    """Keeps views of a board that differ from each other, and of a film those in which it stood still."""

    def __init__(self, board: Board, size: tuple[int, int], film: bool) -> None:
        self._corners, self._size, self._film = board.corners, size, film
        self._outlines: list[FloatArray] = []
        self._before: FloatArray | None = None
        self.views: list[BoardView] = []

    def add(self, view: BoardView) -> bool:
        """Take in a view; whether it is kept."""
        outline = self._outline(view)
        moved = np.inf if self._before is None else float(np.abs(outline - self._before).max())
        self._before = outline
        least = (DIFFERENT if self._film else NOT_THE_SAME) * self._size[0]
        known = any(float(np.abs(outline - other).max()) < least for other in self._outlines)
        if known or len(self.views) >= MOST_VIEWS or (self._film and moved > STILL * 4.0):
            return False
        self._outlines.append(outline)
        self.views.append(view)
        return True

    def _outline(self, view: BoardView) -> FloatArray:
        """Where the middles (9, 2) of corner, edge and inner regions of the board are in the picture [px], also those not seen."""
        H, _ = cv2.findHomography(self._corners[view.numbers, :2], view.pixels)
        low, high = self._corners[:, :2].min(axis=0), self._corners[:, :2].max(axis=0)
        places = np.array([[low + (high - low) * (u, v) for u in (0.0, 0.5, 1.0) for v in (0.0, 0.5, 1.0)]])
        seen = np.asarray(cv2.perspectiveTransform(places, H), np.float64)[0]
        return np.clip(seen, -np.array(self._size), 2.0 * np.array(self._size))


def calibrate(board: Board, views: Sequence[BoardView], size: tuple[int, int], distortion: Distortion = "full") -> Calibration:
    """The camera that took these views, images of (width, height).

    Args:
        board: that they show.
        views: three or more, in which the board is tilted differently.
        size: of the images [px].
        distortion: `full` is k1 k2 p1 p2 k3, `radial` k1 k2.

    Raises:
        CalibrationError: there are too few, or they do not tell the focal length.
    """
    found = _solved(board, views, size, distortion)
    errors = [float(np.sqrt(np.sum(r**2) / len(r))) for r in found.residuals]
    used = [k for k, error in enumerate(errors) if error <= max(OUTLIER * float(np.median(errors)), TOLERATED)]
    if len(used) < len(views):
        found = replace(_solved(board, [views[k] for k in used], size, distortion), used=tuple(used))
    share = float(found.deviations[0] / found.camera.K[0, 0])
    if not (share < UNKNOWN and found.tilt > LEAST_TILT):
        told = f"the focal length is known to {100.0 * share:.2g} %, from boards tilted by {math.degrees(found.tilt):.0f} deg"
        raise CalibrationError(f"{told} against each other: show the board tilted to several sides")
    return found


def _solved(board: Board, views: Sequence[BoardView], size: tuple[int, int], distortion: Distortion) -> Calibration:
    if len(views) < FEWEST_VIEWS:
        raise CalibrationError(f"{len(views)} usable views of the {board}; {FEWEST_VIEWS} or more are needed, tilted differently")
    points = [board.corners[view.numbers].astype(np.float32) for view in views]
    pixels = [view.pixels.astype(np.float32) for view in views]
    cv = cast("Any", cv2)  # its stubs know no calibration without a first guess
    try:
        rms, K, D, turns, places, deviations, _, _ = cv.calibrateCameraExtended(points, pixels, size, None, None, flags=_HELD[distortion])
    except cv2.error as error:
        raise CalibrationError("the views do not determine a camera: show the board tilted to several sides") from error
    projected = [cv.projectPoints(x, turn, place, K, D)[0].reshape(-1, 2) for x, turn, place in zip(points, turns, places, strict=True)]
    residuals = tuple(view.pixels - np.asarray(p, np.float64) for view, p in zip(views, projected, strict=True))
    normals = np.array([cv2.Rodrigues(np.asarray(turn, np.float64))[0][:, 2] for turn in turns])
    tilt = float(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0)).max())
    camera = CameraInfo(size[0], size[1], np.asarray(K, np.float64), np.asarray(D, np.float64).reshape(-1)[:5])
    return Calibration(camera, float(rms), np.asarray(deviations, np.float64).reshape(-1)[:4], tuple(range(len(views))), residuals, tilt)
