"""Depth images laid over colour images."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.errors import SlamError
from slam.kernels.alignment import align
from slam.messages import RgbdImage


class DepthLensError(SlamError):
    """A depth image with distortion: stereo cameras report rectified ones."""


def aligned_depth(image: RgbdImage) -> NDArray[np.float32]:
    """Depth (H, W) [m] along the colour camera's axis in each pixel of the colour image; nan where it is not known.

    Raises:
        DepthLensError: the depth camera's lens distorts.
    """
    colour, depth = image.colour_info, image.depth_info
    if depth.D.any():
        raise DepthLensError(f"the depth camera's distortion is {depth.D.tolist()}, must be all 0: rectify the depth image first")
    T_colour_depth = colour.T_base_camera.inverse() @ depth.T_base_camera
    T = np.array(T_colour_depth.R), np.array(T_colour_depth.t)
    return align(image.depth, depth.K, T, (colour.K, colour.D), (colour.height, colour.width))
