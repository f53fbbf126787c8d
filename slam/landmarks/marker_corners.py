"""Ways to the corners of a marker below the pixel: our own lines, and OpenCV's for comparison."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from slam.kernels.corner_fit import fit_corners
from slam.kernels.lens import Lens, to_ray
from slam.messages import CameraInfo
from slam.se2 import FloatArray

CornerMethod = Literal["lines", "none", "subpix", "contour", "apriltag"]
"""`lines` fits the edges; the others are OpenCV's `CORNER_REFINE_...`."""
APRILTAG_SHIFT = 0.46
"""AprilTag counts pixel centres at .5: its corners lie too far right and down [px]; measured 0.41 to 0.49."""
DEVIATION: dict[CornerMethod, float] = {"none": 0.5, "subpix": 0.25, "contour": 0.5, "apriltag": 0.25}
"""Of a corner, where the method says nothing of itself [px]."""


def lens_of(camera: CameraInfo) -> Lens:
    """The camera's lens as kernels take it."""
    K = camera.K
    return float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]), np.array(camera.D)


def fit_lines(grey: NDArray[np.uint8], corners: FloatArray, modules: FloatArray, camera: CameraInfo) -> tuple[FloatArray, ...]:
    """Rays and pixels (N, 4, 2), covariances (N, 4, 2, 2) and quality (N, 3), see `slam.kernels.corner_fit`.

    Covariances are of rays, not of pixels.
    """
    rays, pixels, covariances, quality = fit_corners(grey, corners, modules, lens_of(camera))
    return rays, pixels, covariances / (camera.K[0, 0] * camera.K[1, 1]), quality


def as_found(corners: FloatArray, method: CornerMethod, camera: CameraInfo) -> tuple[FloatArray, ...]:
    """The same of OpenCV's corners (N, 4, 2); blur is not known."""
    pixels, lens = corners - (APRILTAG_SHIFT if method == "apriltag" else 0.0), lens_of(camera)
    rays = np.array([[to_ray(lens, u, v) for u, v in marker] for marker in pixels.tolist()]).reshape(-1, 4, 2)
    variance = DEVIATION[method] ** 2 / (camera.K[0, 0] * camera.K[1, 1])
    quality = np.tile([DEVIATION[method], 255.0, np.nan], (len(corners), 1))
    return rays, pixels, np.tile(variance * np.eye(2), (len(corners), 4, 1, 1)), quality
